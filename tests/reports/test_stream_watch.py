"""The live table of sensors: what it shows, and that it keeps to the terminal."""

from collections import deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.stream_plan import StreamColumn
from sphero_probe.reports.samples import Samples
from sphero_probe.reports.sparkline import sparkline
from sphero_probe.reports.stream_watch import page

COLUMNS = [StreamColumn("pitch", "deg"), StreamColumn("speed", "")]


def shown(width: int, height: int, *, unicode: bool = True) -> str:
    history = {"pitch": deque([1.0, 2.0, -3.5]), "speed": deque[float]()}
    return page(COLUMNS, history, "3 samples; Ctrl-C ends", width, height, unicode=unicode).plain


def test_a_page() -> None:
    assert shown(80, 24).splitlines() == [
        "Sensor           Value      Least       Most",
        "pitch [deg]       -3.5       -3.5          2  ▇█▁",
        "speed",
        "3 samples; Ctrl-C ends",
    ]


@pytest.mark.parametrize("width", [1, 20, 40, 80])
@pytest.mark.parametrize("height", [1, 5, 24])
def test_it_is_never_larger_than_the_terminal(width: int, height: int) -> None:
    lines = shown(width, height, unicode=False).splitlines()
    assert all(len(line) <= width for line in lines)
    assert len(lines) <= max(height, 3)
    assert "".join(lines).isascii()


@given(st.lists(st.floats(-1e300, 1e300), max_size=50), st.integers(0, 30), st.booleans())
def test_a_sparkline_has_its_extremes_at_the_ends_of_its_scale(
    values: list[float], width: int, unicode: bool
) -> None:
    line = sparkline(values, width, unicode=unicode)
    recent = values[-width:] if width else []
    assert len(line) == len(recent)
    if recent and max(recent) > min(recent):
        assert line[recent.index(max(recent))] == ("█" if unicode else "#")
        assert line[recent.index(min(recent))] == ("▁" if unicode else "_")


def test_values_that_arrive_apart_are_one_sample() -> None:
    samples = Samples(COLUMNS)
    assert samples.add({"pitch": 1.0}, 10.0, "t0") is None
    assert samples.add({"other": 5}, 10.01, "t0") is None
    first = samples.add({"speed": 2}, 10.02, "t1")
    assert first is not None
    assert first.data["values"] == {"pitch": 1.0, "speed": 2}
    assert first.data["seconds"] == 0.0
    assert samples.add({"pitch": 3.0}, 10.1, "t2") is None
    second = samples.add({"pitch": 4.0}, 10.2, "t3")
    assert second is not None
    assert second.data["values"] == {"pitch": 3.0, "speed": None}
    assert second.data["seconds"] == 0.1
    last = samples.end()
    assert last is not None
    assert last.data["values"] == {"pitch": 4.0, "speed": None}
    assert samples.end() is None
