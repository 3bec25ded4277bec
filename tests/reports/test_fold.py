"""Many ids in few words, long words in short lines."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from sphero_probe.reports.ids import pair_spans, spans
from sphero_probe.reports.terminal import fold
from tests.support.reports_by_hand import (
    expanded,
)


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        pytest.param([], [], id="none"),
        pytest.param([7], ["0x07"], id="one"),
        pytest.param([8, 7], ["0x07", "0x08"], id="two neighbours"),
        pytest.param([9, 7, 8, 8], ["0x07-0x09"], id="a run"),
        pytest.param(
            [0, 1, 2, 5, 7, 8, 9, 10, 255], ["0x00-0x02", "0x05", "0x07-0x0a", "0xff"], id="several"
        ),
    ],
)
def test_spans(numbers: list[int], expected: list[str]) -> None:
    assert spans(numbers) == expected


def test_devices_that_are_alike_go_together() -> None:
    pairs = [(did, cid) for did in (0x1D, 0x1E, 0x1F) for cid in range(256)] + [(0x13, 5)]
    assert pair_spans(pairs) == ["0x13:0x05", "0x1d-0x1f:0x00-0xff"]


@given(st.sets(st.tuples(st.integers(0, 255), st.integers(0, 255)), max_size=60))
def test_spans_name_each_pair_and_no_other(pairs: set[tuple[int, int]]) -> None:
    assert expanded(", ".join(pair_spans(pairs))) == pairs


@given(st.text(st.sampled_from("ab_.漢 "), max_size=60), st.integers(2, 30))
def test_fold_keeps_to_the_width_and_loses_nothing_but_blanks(text: str, width: int) -> None:
    lines = fold(text, width)
    assert max(map(cell_len, lines)) <= width
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


@pytest.mark.parametrize(
    ("text", "width", "lines"),
    [
        pytest.param("8d 0a 13 10", 8, ["8d 0a 13", "10"], id="bytes"),
        pytest.param("get_battery_percentage", 12, ["get_battery_", "percentage"], id="behind joints"),
        pytest.param("a get_battery", 8, ["a", "get_", "battery"], id="a word of its own lines"),
        pytest.param("abcdefgh", 3, ["abc", "def", "gh"], id="no joints"),
        pytest.param("  two", 10, ["  two"], id="fits as it is"),
        pytest.param("", 10, [""], id="empty"),
    ],
)
def test_fold(text: str, width: int, lines: list[str]) -> None:
    assert fold(text, width) == lines
