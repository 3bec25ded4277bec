# ruff: noqa: RUF001 - pages count with a multiplication sign
"""The table of a run: what stands where, in which words, at any width."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.finding import Finding, Note
from sphero_probe.reports.rows import Row, finding_row, heading_row, note_row
from tests.support.reports_by_hand import (
    CALIBRATED,
    HEADING,
    HOSTILE,
    PRIMARY,
    SECONDARY,
    answered,
    expanded,
    refused,
    rendered,
    run_of,
    silent,
)

MIXED = [
    answered(1, 0x13, 0x10, 0x00, b"\x57"),
    answered(2, 0x13, 0x01, 0x05),
    answered(3, 0x13, 0x99, 0x05),
    answered(4, 0x18, 0x99, 0x00, bytes.fromhex("010203")),
    answered(5, 0x11, 0x00, 0x00, bytes.fromhex("000500000002")),
    silent(6, 0x13, 0x9A),
    answered(7, 0x13, 0x9B, 0x08),
    answered(8, 0x13, 0x9C, 0x42, b"\x01"),
    answered(9, 0x13, 0x9D, 0x02),
    answered(10, 0x13, 0x9E, 0x02),
    answered(11, 0xEE, 0x00, 0x01),
    refused(
        12,
        0x13,
        0x00,
        Risk.BRICK,
        "brick: power.enter_deep_sleep, not even at a wrong length (--allow brick)",
    ),
    *(
        refused(13 + at, 0x1D, 0x60 + at, Risk.BRICK, "brick: unknown command (--allow brick)")
        for at in range(6)
    ),
    refused(19, 0x1D, 0x70, Risk.BRICK, "brick: unknown command (--allow brick)"),
]
NOTES = [
    note_row(CALIBRATED),
    *(note_row(Note("notification", f"0x18:0x02 sensor.x{at}", {})) for at in (0, 0, 1, 2, 3, 4)),
    note_row(Note("malformed", "checksum 0x3f, expected 0x40", {"raw": "8d"})),
]


def shuffled(findings: list[Finding]) -> list[Finding]:
    return findings[1::2] + findings[::2]


def test_a_whole_page() -> None:
    assert rendered("table", run_of(shuffled(MIXED), NOTES)).splitlines() == [
        "Sphero BOLT SB-1B2C, firmware: primary 5.0.2, secondary 4.1.7",
        "19 probes: 5 exist, 3 absent, 1 silent, 8 blocked, 2 inconclusive; 19 frames",
        "  sent in 1.2 s",
        "Plan sweep on primary, allowed: read, probe",
        "Started 2025-11-21T22:31:00Z, sphero-probe 0.1.0",
        "Length check, primary: strict (surplus bytes are rejected, and only where a",
        "  command exists)",
        "6 notifications: 2 × 0x18:0x02 sensor.x0, 0x18:0x02 sensor.x1, 0x18:0x02",
        "  sensor.x2, and 2 more",
        "1 malformed frame: checksum 0x3f, expected 0x40",
        "",
        "     DID:CID    Name                    State                                 ms",
        "─" * 80,
        "NEW: 2 commands, not in any catalogue",
        "NEW  0x13:0x99  not in any catalogue    exists, wrong length                31.2",
        "NEW  0x18:0x99  not in any catalogue    exists: 01 02 03                    31.2",
        "",
        "system_info 0x11",
        "     0x11:0x00  get_main_app_version    exists: major 5, minor 0, revision  31.2",
        "                                        2",
        "",
        "power 0x13",
        "     0x13:0x01  sleep                   exists, wrong length                31.2",
        "     0x13:0x10  get_battery_percentage  exists: percentage 87 %             31.2",
        "",
        "Silent: 1 command without an answer",
        "     0x13:0x9a  not in any catalogue    no answer, asked 3 times",
        "",
        "Inconclusive: 2 commands that could not be settled",
        "     0x13:0x9b  not in any catalogue    busy (busy each time it was sent)   31.2",
        "     0x13:0x9c  not in any catalogue    0x42 unlisted: 01 (a code in no     31.2",
        "                                        document)",
        "",
        "Blocked: not sent (--detail lists each command and the reason)",
        "  8 × brick (--allow brick --confirm NAME-OF-ROBOT): 0x13: 1, 0x1d: 7",
        "",
        "Not shown: 1 × 0x01 bad device id, 2 × 0x02 bad command id (absent, or hidden",
        "  from this client)",
    ]


def test_a_detailed_page_lists_what_was_blocked() -> None:
    brief, detailed = (
        rendered("table", run_of(MIXED, NOTES), detail=detail).splitlines() for detail in (False, True)
    )
    at = detailed.index("Blocked: these were not sent")
    assert brief[:at] == detailed[:at]
    assert detailed[at + 1 : at + 5] == [
        "  1 × brick: a documented command, not even at a wrong length (--allow brick):",
        "      0x13:0x00 power.enter_deep_sleep",
        "  7 × brick: unknown command (--allow brick):",
        "      0x1d:0x60-0x65, 0x1d:0x70",
    ]


def test_a_device_of_many_nodes_is_named_once_and_equal_counts_go_together() -> None:
    findings = [
        refused(number, did, cid, Risk.BRICK, "brick: x (y)", target=target)
        for number, (target, did, cid) in enumerate(
            ((node, did, cid) for node in (PRIMARY, SECONDARY) for did in (0x1B, 0x1D) for cid in range(256)),
            1,
        )
    ]
    shown = rendered(
        "table", run_of([*findings, refused(9999, 0x13, 0, Risk.WRITE, "write: x (y)")]), width=120
    )
    assert "  1 × write (--allow write): primary 0x13: 1\n" in shown
    assert (
        "  1024 × brick (--allow brick --confirm NAME-OF-ROBOT): "
        "primary 0x1b 0x1d: 256 each; secondary 0x1b 0x1d: 256 each\n"
    ) in shown


def test_what_a_command_was_sent_with_is_shown() -> None:
    asked = [
        answered(number, 0x10, 0x06, 0x00, b"\x01\x02", request=bytes([did]))
        for number, did in enumerate((0x13, 0x11), 1)
    ]
    shown = rendered("table", run_of(asked))
    assert "get_supported_cids did 0x13" in shown
    assert "get_supported_cids did 0x11" in shown


def test_ascii_page_says_the_same() -> None:
    plain = rendered("table", run_of(MIXED, NOTES), unicode=False)
    assert plain.isascii()
    assert plain == rendered("table", run_of(MIXED, NOTES)).replace("─", "-").replace("×", "x")


def test_a_wide_page_folds_nothing() -> None:
    shown = rendered("table", run_of(MIXED, NOTES), width=120)
    assert "     0x11:0x00  get_main_app_version    exists: major 5, minor 0, revision 2" in shown
    assert "0x42 unlisted: 01 (a code in no document)" in shown


@pytest.mark.parametrize("width", [1, 60, 80, 100, 120, 200])
@pytest.mark.parametrize("unicode", [False, True], ids=["ascii", "unicode"])
def test_keeps_to_the_width_and_tells_all_ids(width: int, unicode: bool) -> None:
    shown = rendered("table", run_of(MIXED, NOTES), width=width, unicode=unicode, detail=True)
    assert max(map(cell_len, shown.splitlines())) <= max(width, 60)
    told = {(f.command.did, f.command.cid) for f in MIXED if f.outcome != "absent"}
    assert told == expanded(shown) - {(0x18, 0x02)}


def test_two_nodes_are_told_apart() -> None:
    findings = [
        answered(1, 0x13, 0x10, 0x00, b"\x57"),
        answered(2, 0x13, 0x99, 0x05, target=SECONDARY),
        refused(3, 0x13, 0x00, Risk.BRICK, "brick: power.enter_deep_sleep (x)", target=PRIMARY),
        refused(4, 0x13, 0x77, Risk.PERSIST, "persist: unknown (x)", target=SECONDARY),
        silent(5, 0x13, 0x98, target=0x13),
    ]
    shown = rendered("table", run_of(findings), detail=True)
    assert "Plan sweep, allowed: read, probe" in shown
    assert "NEW  secondary  0x13:0x99" in shown
    assert "     primary    0x13:0x10  get_battery_percentage" in shown
    assert "     node 0x13  0x13:0x98" in shown
    assert "primary 0x13:0x00 power.enter_deep_sleep" in shown
    assert "secondary 0x13:0x77" in shown


def test_without_addresses_the_node_is_the_robot() -> None:
    shown = rendered("table", run_of([answered(1, 0x13, 0x10, 0x00, b"\x57", target=None)]))
    assert "Plan sweep on robot, allowed: read, probe" in shown


def test_an_answer_that_proves_nothing_is_neither_new_nor_counted_as_existing() -> None:
    findings = [answered(1, 0x13, 0x10, 0x05, masked=True), answered(2, 0x13, 0x99, 0x05, masked=True)]
    shown = rendered("table", run_of(findings))
    assert "NEW" not in shown
    assert "cannot exist get the same answer" in shown
    assert "0 exist, 2 inconclusive" in shown


@pytest.mark.parametrize(
    "findings",
    [
        pytest.param([silent(at + 1, 0x13, at) for at in range(256)], id="silent"),
        pytest.param([answered(at + 1, 0x13, at, 0x08) for at in range(256)], id="busy"),
        pytest.param([answered(at + 1, 0x77, at, 0x05, masked=True) for at in range(256)], id="maybe"),
    ],
)
def test_a_crowd_is_told_by_its_ids(findings: list[Finding]) -> None:
    shown = rendered("table", run_of(findings))
    assert shown.count("\n") < 20
    assert {(f.command.did, f.command.cid) for f in findings} == expanded(shown)


def test_what_is_known_to_exist_is_never_a_crowd() -> None:
    findings = [answered(at + 1, 0x77, at, 0x05) for at in range(250)]
    assert rendered("table", run_of(findings)).count("NEW  0x77:") == 250


def test_reasons_that_differ_in_the_name_only_are_one() -> None:
    findings = [
        refused(1, 0x13, 0x00, Risk.BRICK, "brick: power.enter_deep_sleep (--allow brick)"),
        refused(2, 0x1A, 0x35, Risk.BRICK, "brick: user_io.delete_all (--allow brick)"),
        refused(
            3,
            0x13,
            0x08,
            Risk.PERSIST,
            "persist: unknown, next to power.prepare_for_shutdown (--allow persist)",
        ),
        refused(
            4, 0x13, 0x09, Risk.PERSIST, "persist: unknown, next to power.set_power_options (--allow persist)"
        ),
    ]
    shown = rendered("table", run_of(findings), width=120, detail=True)
    assert (
        "2 × brick: documented, not asked (--allow brick):\n      0x13:0x00 power.enter_deep_sleep, 0x1a:0x35"
        in shown
    )
    assert (
        "2 × persist: unknown, next to a documented command (--allow persist):\n      0x13:0x08, 0x13:0x09\n"
        in shown
    )


def test_an_unknown_robot_takes_device_names_from_the_commands() -> None:
    rows = [heading_row(HEADING._replace(robot="", model="unknown model")), finding_row(MIXED[0])]
    assert "power 0x13\n" in rendered("table", rows)


def test_a_device_without_a_name_has_its_number() -> None:
    rows = run_of([answered(1, 0x77, 0x01, 5)])
    named = Row("finding", finding_row(answered(1, 0x77, 0x01, 5)).data | {"name": "x.y"})
    shown = rendered("table", [rows[0], named, rows[-1]])
    assert "\n0x77\n" in shown
    assert "0x77:0x01  x.y" in shown


def test_long_answers_are_folded_between_bytes() -> None:
    payload = bytes(range(256)) * 2
    lines = rendered("table", run_of([answered(1, 0x13, 0x99, 0x00, payload)])).splitlines()
    titles = next(number for number, line in enumerate(lines) if "State" in line)
    left, right = lines[titles].index("State"), lines[titles].index("ms") - 2
    cells = [line[left:right].strip().removeprefix("exists: ") for line in lines[titles + 3 :]]
    assert len(cells) > 10
    assert all(re.fullmatch(r"[0-9a-f]{2}( [0-9a-f]{2})*", cell) for cell in cells)
    assert bytes.fromhex("".join(cells)) == payload


def test_names_of_what_is_withheld_stay_beside_their_ids() -> None:
    pairs = [(0x13, 0x00), (0x13, 0x12), (0x13, 0x23), (0x1A, 0x39)]
    findings = [refused(at, *pair, Risk.PERSIST, "persist: x (y)") for at, pair in enumerate(pairs, 1)]
    lines = [line.strip(" ,") for line in rendered("table", run_of(findings), detail=True).splitlines()]
    assert "0x13:0x00 power.enter_deep_sleep, 0x13:0x12 power.set_power_options" in lines
    assert "0x13:0x23 power.set_battery_calibration_slope_and_intercept" in lines
    at = lines.index("0x1a:0x39")
    assert lines[at + 1] == "user_io.override_compressed_frame_player_animation_global_settings"


def test_long_names_are_folded_behind_joints() -> None:
    shown = rendered("table", run_of([answered(1, 0x1A, 0x39, 0x00, bytes(range(60)))]))
    assert "override_compressed_frame_" in shown
    assert "player_animation_" in shown


def test_a_hostile_device_does_not_fill_the_page() -> None:
    heading = heading_row(HEADING._replace(device=HOSTILE + "x" * 100_000))
    shown = rendered("table", [heading])
    assert len(shown) < 1000
    assert "…" in shown


@given(
    st.lists(
        st.builds(
            lambda kind, did, cid, code, payload, target: (
                silent(1, did, cid, target=target)
                if kind == 0
                else refused(1, did, cid, Risk.PERSIST, "persist: x (y)", target=target)
                if kind == 1
                else answered(1, did, cid, code, payload, target=target, masked=kind == 2)
            ),
            st.integers(0, 9),
            st.sampled_from([0x10, 0x11, 0x13, 0x1A, 0x77]),
            st.integers(0, 255),
            st.integers(0, 12),
            st.binary(max_size=40),
            st.sampled_from([None, 0x11, 0x12, 0x1F]),
        ),
        max_size=60,
    ),
    st.sampled_from([60, 80, 120]),
    st.booleans(),
)
def test_any_run_keeps_to_the_width_and_loses_nothing(made: list[Finding], width: int, unicode: bool) -> None:
    findings = [finding._replace(number=number) for number, finding in enumerate(made, 1)]
    shown = rendered("table", run_of(findings), width=width, unicode=unicode, detail=True)
    assert max(map(cell_len, shown.splitlines())) <= width
    told = {(f.command.did, f.command.cid) for f in findings if f.outcome != "absent"}
    assert told == expanded(shown)
    absent = sum(f.outcome == "absent" for f in findings)
    counted = re.search(r"Not shown: (.*)", shown, re.DOTALL)
    assert sum(int(n) for n in re.findall(r"(\d+)\s+[x×]", counted[1] if counted else "")) == absent
