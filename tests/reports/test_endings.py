"""What the head of a run's table says: whole, empty, stopped, cut off, or without a run."""

from datetime import UTC, datetime

import pytest

from sphero_probe.probing.finding import Confidence, Note
from sphero_probe.probing.notes import executed_note
from sphero_probe.probing.retries import DEAD, LOST
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.rows import Row, finding_row, heading_row, note_row, summary_row
from sphero_probe.reports.run_ending import RunEnding
from tests.support.reports_by_hand import (
    CALIBRATED,
    HEADING,
    answered,
    rendered,
    run_of,
    silent,
    summary,
)

SOME = [answered(1, 0x13, 0x10, 0x00, b"\x57"), answered(2, 0x13, 0x01, 0x05)]


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        pytest.param(run_of([]), "Nothing was asked: the run had no probes.", id="no probes"),
        pytest.param([], "Nothing was asked.", id="no rows"),
        pytest.param(
            run_of([answered(1, 0x13, 0x99, 2)]),
            "1 probe: 0 exist, 1 absent; 1 frame sent in 1.2 s",
            id="all absent",
        ),
        pytest.param(
            run_of(SOME, complete=False),
            "Incomplete: it was stopped before everything was asked.",
            id="stopped",
        ),
        pytest.param(
            [heading_row(HEADING), finding_row(SOME[0])],
            "Incomplete: the record of this run ends before the run did.",
            id="cut off",
        ),
    ],
)
def test_the_head_says_how_a_run_ended(rows: list[Row], expected: str) -> None:
    shown = rendered("table", rows)
    assert expected in shown.splitlines()[:3]


def test_a_finished_run_is_not_called_unfinished() -> None:
    shown = rendered("table", run_of(SOME))
    assert "Incomplete" not in shown


def test_findings_without_a_run_need_no_end() -> None:
    shown = rendered("table", [finding_row(SOME[0])])
    assert "node 0x11  0x13:0x10  get_battery_percentage  exists: percentage 87 %  31.2" in shown
    assert "Incomplete" not in shown


def test_strictness_comes_from_the_heading_where_no_note_tells_it() -> None:
    heading = heading_row(
        HEADING._replace(strictness={"primary": "strict", "secondary": "unknown"}, firmware={})
    )
    shown = rendered("table", [heading])
    assert "Length check, primary: strict\nLength check, secondary: unknown\n" in shown
    assert "firmware: unknown" in shown


EXECUTED = note_row(executed_note(Command(0x16, 0x99, bytes(11), 0x11), "", datetime(2026, 1, 1, tzinfo=UTC)))
ECHO = Command(0x10, 0x00, b"sphero", 0x11)


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        pytest.param([EXECUTED], "a wrong length was executed", id="executed"),
        pytest.param(
            [finding_row(silent(1, 0x13, 0x10)._replace(note=DEAD))],
            "a node does not answer as it should",
            id="given up",
        ),
        pytest.param(
            [finding_row(silent(1, 0x13, 0x10)._replace(note=LOST))], "the link was lost", id="link lost"
        ),
        pytest.param(
            [finding_row(answered(1, 0x13, 0x10, 0x0A))], "a node was unavailable", id="node says so"
        ),
        pytest.param([finding_row(silent(1, *ECHO[:2]))], "a node was unavailable", id="no echo"),
        pytest.param(
            [finding_row(silent(1, 0x13, 0x99))], "it was stopped before everything was asked", id="stopped"
        ),
    ],
)
def test_an_incomplete_run_says_why(rows: list[Row], expected: str) -> None:
    start, end = run_of([])[0], summary_row(summary([], complete=False))
    assert f"Incomplete: {expected}" in rendered("table", [start, *rows, end])
    ending = RunEnding()
    for row in [start, *rows]:
        ending.add(row)
    assert ending.message().startswith(f"the run is incomplete: {expected}")


def test_all_reasons_are_named_the_surprise_first() -> None:
    ending = RunEnding()
    ending.add(heading_row(HEADING))
    ending.add(finding_row(answered(1, 0x13, 0x10, 0x0A)))
    ending.add(EXECUTED)
    assert len(ending.reasons) == 2
    assert ending.reasons[0].startswith("a wrong length was executed")


def test_what_was_executed_leads_the_page() -> None:
    assert rendered("table", run_of(SOME, [EXECUTED], complete=False)).startswith("Executed: 0x16:0x99")


def test_nodes_with_the_same_result_share_a_line_and_evidence_joins_its_node() -> None:
    notes = [
        CALIBRATED,
        Note("calibration", "node 0x13: no such node (x)", {}),
        Note("calibration", "node 0x14: no such node (x)", {}),
        Note("evidence", "primary: 3 of 3 commands", {}),
        Note("evidence", "primary: 7 of 7 commands", {}),
        Note("evidence", "secondary: 1 of 1 commands", {}),
    ]
    lines = rendered("table", run_of(SOME, list(map(note_row, notes))), width=200).splitlines()
    assert [line for line in lines if line.startswith("Length check")] == [
        f"Length check, {CALIBRATED.text}; 7 of 7 commands",
        "Length check, node 0x13, node 0x14: no such node (x)",
        "Length check, secondary: 1 of 1 commands",
    ]


def test_differences_are_listed_with_devices_that_are_absent() -> None:
    pair = {"target": 0x11, "did": 0x13, "cid": 0x99}
    data: dict[str, object] = {
        "hidden": [pair],
        "ghost": [],
        "unknown": [pair],
        "ghost_devices": [{"target": 0x11, "did": 0x1C}],
    }
    shown = rendered("table", run_of(SOME, [note_row(Note("comparison", "", data))]))
    assert (
        "Differences from the robot's own list and the catalogue\n"
        "  1 hidden (exist, but not in the robot's list):\n      0x13:0x99\n"
        "  1 unknown (exist, but not in any catalogue):\n      0x13:0x99\n"
        "  1 ghost device (in the robot's list, but absent):\n      0x1c\n"
    ) in shown


def test_what_is_uncertain_never_leads_and_is_not_counted_as_existing() -> None:
    """Runs of version 0.1.0 have such findings."""
    findings = [
        answered(1, 0x13, 0x10, 0x05)._replace(confidence=Confidence.MAYBE, note="masked"),
        answered(2, 0x13, 0x99, 0x05)._replace(confidence=Confidence.MAYBE, note="masked"),
        answered(3, 0x11, 0x00, 0x00, bytes(6)),
    ]
    shown = rendered("table", run_of(findings))
    assert "NEW" not in shown
    assert (
        shown.index("0x11:0x00") < shown.index("Maybe: 2 commands that may exist") < shown.index("0x13:0x10")
    )
    assert "3 probes: 1 exist, 2 maybe;" in shown
