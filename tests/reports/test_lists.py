"""Lists as tables for people: columns, folding, colour, width."""

import re

import pytest
from rich.cells import cell_len

from sphero_probe.catalogue import ROBOTS, all_rows, lookup, rows_of
from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.dry_run import PlannedProbe
from sphero_probe.protocol.packets import Command, Malformed, Request, Response
from sphero_probe.reports import views
from sphero_probe.reports.address_phrases import other_nodes
from sphero_probe.reports.matrix import Matrix
from sphero_probe.reports.rows import (
    Row,
    command_row,
    finding_row,
    packet_row,
    planned_row,
    robot_row,
)
from sphero_probe.transports.base import Seen
from tests.support.reports_by_hand import ASKED, BOLT, LISTS, PRIMARY, RUN, V2, rendered

COLOUR = re.compile(r"\x1b\[[0-9;]*m")


@pytest.mark.parametrize("width", [60, 80, 120])
@pytest.mark.parametrize("unicode", [False, True], ids=["ascii", "unicode"])
@pytest.mark.parametrize("name", LISTS)
def test_lists_keep_to_the_width(name: str, width: int, unicode: bool) -> None:
    view, rows = LISTS[name]
    shown = rendered("table", rows, view, width=width, unicode=unicode)
    lines = shown.splitlines()
    assert max(map(cell_len, lines)) <= width
    assert not any(line.endswith(" ") for line in lines)
    assert unicode or shown.isascii()


def test_wide_characters_keep_to_the_width() -> None:
    rows = [robot_row(Seen("漢字" * 60, None, "住所" * 40, -61))]
    shown = rendered("table", rows, views.ROBOTS)
    assert max(map(cell_len, shown.splitlines())) <= 80
    assert shown.count("漢") == 60
    assert shown.count("住") == 40


def test_robots() -> None:
    rows = [
        robot_row(Seen("SB-1B2C", BOLT, "AA:BB:CC:DD:EE:FF", -61)),
        robot_row(Seen("evil\x1b[2J\u202e", None, "11:22", -101)),
    ]
    assert rendered("table", rows, views.ROBOTS) == (
        "Name               Model        Protocol  Address            RSSI dBm\n"
        "─────────────────────────────────────────────────────────────────────\n"
        "SB-1B2C            Sphero BOLT  v2        AA:BB:CC:DD:EE:FF       -61\n"
        "evil\\x1b[2J\\u202e                         11:22                  -101\n"
    )
    assert rendered("table", rows, views.ROBOTS, unicode=False).splitlines()[1] == "-" * 69


def test_packets() -> None:
    rows = [
        packet_row(Request(Command(0x13, 0x10, b"", 0x12), 7, 0x01), V2, b"\x8d\xd8"),
        packet_row(Response(7, 0, b"\x5f", 0x13, 0x10, 0x12), V2, b"\x8d\xd8"),
        packet_row(Response(8, 0x42, b"\x5f", 0x13, 0x99), V2, b"\x8d\xd8"),
        packet_row(Malformed(b"\x8d\x01", "no end"), V2, b"\x8d\x01"),
    ]
    assert rendered("table", rows, views.PACKETS, width=100).splitlines()[2:] == [
        "command    0x13:0x10    7  0x01 to 0x12  power.get_battery_percentage",
        "response   0x13:0x10    7  from 0x12     power.get_battery_percentage  success: percentage 95 %",
        "response   0x13:0x99    8                                              0x42 unlisted: 5f",
        "malformed                                                              no end: 8d 01",
        "",
        "0x01, source of a command: port 0, node 1: the client itself",
        "0x12, source of an answer: port 1, node 2: node 2 behind port 1, already translated for the client",
        "  (inferred)",
        "0x12, target of a command: port 1, node 2: node 2 of the robot, behind the client's Bluetooth",
    ]


def test_the_addresses_of_packets_are_told_in_words_once_each_and_fit() -> None:
    answer = packet_row(Response(7, 0, b"", 0x1A, 0x1C, 0x01, 0x21), V2, b"\x8d\xd8")
    shown = rendered("table", [answer] * 3, views.PACKETS).splitlines()
    assert shown[-2:] == [
        "0x01, source of an answer: port 0, node 1: node 1 of the robot, which answers",
        "0x21, target of an answer: port 2, node 1: the client behind the robot's UART",
    ]
    many = [packet_row(Request(Command(0x13, 0x10, b"", byte), 7), V2, b"") for byte in range(256)]
    shown = rendered("table", many, views.PACKETS).splitlines()
    assert max(map(len, shown)) <= 80
    assert shown[-1] == "and 240 more"
    assert "0x00, target of a command" in "".join(shown)


def test_a_sweep_tells_who_answered_for_another_node_in_words() -> None:
    exists = {"target": 0x12, "outcome": "exists"}
    findings: list[dict[str, object]] = [
        exists | {"answered_by": 0x02},
        exists | {"answered_by": 0x01},
        exists | {"answered_by": 0x01, "outcome": "inconclusive"},
        exists | {"answered_by": 0x05, "outcome": "absent"},
        exists | {"answered_by": 0x05, "target": None},
        exists | {"answered_by": None},
    ]
    assert other_nodes(findings, ROBOTS["rvr"]) == [
        "Answered for another node: 0x01: port 0, node 1: node 1 (primary) of the robot, which answers"
    ]


def test_commands_and_one_command() -> None:
    (known,) = rows_of(V2, 0x13, 0x03)
    assert "power.get_battery_voltage  read  nothing -> voltage:uint/100[V]" in rendered(
        "table", [command_row(known)], views.COMMANDS
    )
    one = rendered("table", [command_row(known)], views.COMMAND).splitlines()
    assert one[:2] == ["Protocol        v2", "DID:CID         0x13:0x03"]
    assert "Takes -> gives  nothing -> voltage:uint/100[V]" in one
    assert any(line.startswith("Known from") and "spherov2" in line for line in one)


def test_the_whole_catalogue_fits_and_is_whole() -> None:
    rows = [command_row(known) for known in all_rows(V2)]
    shown = rendered("table", rows, views.COMMANDS)
    assert max(map(cell_len, shown.splitlines())) <= 80
    assert all(f"0x{known.did:02x}:0x{known.cid:02x}" in shown for known in all_rows(V2))
    wide = rendered("table", rows, views.COMMANDS, width=400)
    assert all(known.name in wide for known in all_rows(V2))


def test_one_finding() -> None:
    shown = rendered("table", [finding_row(ASKED[0])], views.FINDING).splitlines()
    assert "Name      power.get_battery_percentage" in shown
    assert "Answer    success: percentage 87 %" in shown
    assert "Received  8d 29 11 13 10 01 00 57 4a d8" in shown
    assert (
        "Answer   no answer, asked 3 times"
        in rendered("table", [finding_row(ASKED[3])], views.FINDING).splitlines()
    )
    withheld = rendered("table", [finding_row(ASKED[4])], views.FINDING)
    assert "State    blocked (brick: power.enter_deep_sleep (--allow brick))" in withheld
    assert "Sent" not in withheld


def test_planned_shows_bytes_and_what_is_withheld() -> None:
    known = lookup(V2, 0x13, 0x10, BOLT)
    rows = [
        planned_row(
            PlannedProbe(
                1, Command(0x13, 0x10, b"", PRIMARY), known, Risk.READ, bytes.fromhex("8d0a131007cbd8"), None
            )
        ),
        planned_row(
            PlannedProbe(
                2, Command(0x13, 0x99), None, Risk.PERSIST, b"\x8d\xd8", "persist: unknown (--allow persist)"
            )
        ),
    ]
    shown = rendered("table", rows, views.PLANNED, width=140)
    assert "0x13:0x10  power.get_battery_percentage  read     8d 0a 13 10 07 cb d8" in shown
    assert "not in any catalogue" in shown
    assert "persist: unknown (--allow persist)" in shown


def test_colour_adds_nothing_but_colour() -> None:
    for view, rows in (*LISTS.values(), (views.FINDINGS, RUN)):
        plain = rendered("table", rows, view)
        coloured = rendered("table", rows, view, color=True)
        assert "\x1b" not in plain
        assert "\x1b" in coloured
        assert [line.rstrip() for line in COLOUR.sub("", coloured).splitlines()] == plain.splitlines()


def test_the_environment_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    before = rendered("table", RUN, color=True), rendered("table", RUN)
    for name, value in {
        "NO_COLOR": "1",
        "FORCE_COLOR": "1",
        "TERM": "dumb",
        "COLUMNS": "20",
        "LINES": "3",
    }.items():
        monkeypatch.setenv(name, value)
    assert (rendered("table", RUN, color=True), rendered("table", RUN)) == before


@pytest.mark.parametrize("robots", [5, 14, 40])
def test_a_matrix_of_many_robots_has_signs_and_a_legend(robots: int) -> None:
    matrix = Matrix()
    for number in range(robots):
        state = ("exists", "absent", "silent", "blocked")[number % 4]
        finding = {"did": 0x13, "cid": 0x0D, "name": "power.wake", "state": state}
        matrix.add(f"Sphero BOLT {number:02}", [finding])
    lines = rendered("table", matrix.rows(), matrix.view, width=80).splitlines()
    assert max(map(len, lines)) <= 80
    row = next(line for line in lines if line.startswith("0x13:0x0d"))
    assert row.split()[3:] == list("+-~x" * 4)[: min(robots, 14)]
    legend = lines[lines.index("") + 1 :]
    assert "+ exists, - absent" in legend[0]
    assert [line.split(None, 1)[1] for line in legend[1:15]][:robots] == [
        f"Sphero BOLT {number:02}" for number in range(min(robots, 14))
    ]
    assert ("more robots" in legend[-1]) is (robots > 14)


def test_a_table_of_very_many_columns_does_not_fail() -> None:
    columns = tuple(views.both(f"column {number}") for number in range(60))
    view = views.View("x", columns, "")
    row = Row("x", {column.key: "words and more words" for column in columns})
    shown = rendered("table", [row], view, width=60)
    assert max(map(cell_len, shown.splitlines())) <= 60
