"""Who is near, who is gone and who is new, in a table that is never larger than the terminal."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.scan_watch import GONE_AFTER, Sighting, Sightings, page
from sphero_probe.transports.base import Seen

ONE, TWO, THREE = "AA:BB:CC:DD:EE:01", "AA:BB:CC:DD:EE:02", "AA:BB:CC:DD:EE:03"


def robot(name: str, address: str = ONE, rssi: int | None = -50, **more: Any) -> Seen:
    return Seen(name, robot_by_prefix(name), address, rssi, **more)


def told(sightings: Sightings) -> list[str]:
    return [seen.name for seen in sightings.news()]


def test_news_are_who_appears_and_what_changes_but_the_strength() -> None:
    sightings = Sightings()
    sightings.hear(robot(""), 0)
    sightings.hear(robot("BP-2", TWO), 0)
    assert told(sightings) == ["", "BP-2"]
    sightings.hear(robot("", rssi=-70), 1)
    assert told(sightings) == []
    sightings.hear(robot("BP-1"), 2)
    assert told(sightings) == ["BP-1"]
    sightings.hear(robot("BP-2", TWO, None, connected=True), 3)
    assert told(sightings) == ["BP-2"]
    assert told(sightings) == []


def test_the_order_depends_on_names_and_not_on_strength() -> None:
    sightings = Sightings()
    for name, address, rssi in (("SB-1", ONE, -20), ("", THREE, -10), ("bp-2", TWO, -90), ("BP-1", "A", -99)):
        sightings.hear(robot(name, address, rssi, generation=Generation.V2), 0)
    sightings.hear(robot("Amplifier", "B", -1), 0)
    assert [one.seen.name for one in sightings.listed()] == ["BP-1", "bp-2", "SB-1", "", "Amplifier"]


@pytest.mark.parametrize(
    ("seen", "ago", "says"),
    [
        pytest.param(robot("BP-1"), 0.4, "now", id="now"),
        pytest.param(robot("BP-1"), 3.2, "3 s ago", id="seconds"),
        pytest.param(robot("BP-1"), GONE_AFTER + 2.5, "gone 12 s", id="gone"),
        pytest.param(robot("BP-1"), 150, "gone 2 min", id="gone-for-minutes"),
        pytest.param(robot("BP-1"), 7300, "gone 2 h", id="gone-for-hours"),
        pytest.param(robot("BP-1", connected=True), 3, "connected", id="connected"),
        pytest.param(robot("BP-1", connected=True), 30, "gone 30 s", id="was-connected"),
    ],
)
def test_when_a_robot_was_heard(seen: Seen, ago: float, says: str) -> None:
    lines = page([Sighting(seen, 100)], 100 + ago, width=80, height=24).plain.splitlines()
    assert lines[2].endswith(f"  {says}")


def test_the_table() -> None:
    sightings = [
        Sighting(robot("BP-1234", ONE, -48), 100),
        Sighting(robot("Fred\x1b[2J", TWO, None, generation=Generation.V1, connected=True), 100),
        Sighting(robot("SB-0001", THREE, -100), 80),
    ]
    shown = page(sightings, 100, width=80, height=24)
    assert shown.plain == (
        "Name         Model           Protocol  Address             dBm  Heard\n"
        "─────────────────────────────────────────────────────────────────────────\n"
        "BP-1234      Sphero BOLT+    v2        AA:BB:CC:DD:EE:01   -48  now\n"
        "Fred\\x1b[2J  unknown Sphero  v1        AA:BB:CC:DD:EE:02        connected\n"
        "SB-0001      Sphero BOLT     v2        AA:BB:CC:DD:EE:03  -100  gone 20 s\n"
        "2 near, 1 gone, 1 connected to this machine; Ctrl-C ends"
    )
    dim = [shown.plain[span.start : span.end].split()[0] for span in shown.spans if span.style == "dim"]
    assert dim == ["SB-0001", "2"]


def test_a_narrow_terminal_keeps_addresses_and_drops_what_can_be_missed() -> None:
    sightings = [Sighting(robot("BP-1234"), 0)]
    titles = [page(sightings, 0, width=width, height=24).plain.splitlines()[0] for width in (62, 52, 44, 36)]
    assert [line.split() for line in titles] == [
        ["Name", "Model", "Protocol", "Address", "dBm", "Heard"],
        ["Name", "Model", "Address", "dBm", "Heard"],
        ["Name", "Address", "dBm", "Heard"],
        ["Name", "Address", "Heard"],
    ]


def test_who_is_gone_makes_room_for_who_is_near() -> None:
    sightings = [
        Sighting(robot(f"BP-{number:02}", str(number)), 50 if number % 2 else 100) for number in range(20)
    ]
    lines = page(sightings, 100, width=80, height=14).plain.splitlines()
    assert [line.split()[0] for line in lines[2:-1]] == [f"BP-{number:02}" for number in range(0, 20, 2)]
    assert lines[-1].startswith("10 near, 10 gone, 10 not shown;")


def test_an_empty_room() -> None:
    assert page([], 0, width=80, height=24).plain == "listening, no robot heard yet; Ctrl-C ends"


@given(
    st.lists(
        st.builds(
            robot,
            st.text(max_size=60) | st.just("漢字" * 30),
            st.uuids().map(str) | st.text(max_size=80),
            rssi=st.none() | st.integers(-128, 20),
            generation=st.none() | st.sampled_from(Generation),
            connected=st.booleans(),
        ),
        max_size=30,
    ),
    st.integers(1, 200),
    st.integers(5, 40),
    st.booleans(),
)
def test_never_larger_than_the_terminal(robots: list[Seen], width: int, height: int, unicode: bool) -> None:
    sightings = [Sighting(seen, number) for number, seen in enumerate(robots)]
    lines = page(sightings, 20, width=width, height=height, unicode=unicode).plain.split("\n")
    assert len(lines) < height
    assert max(map(cell_len, lines)) <= width
    assert all(line.isprintable() for line in lines)
    assert unicode or all(line.isascii() for line in lines)
