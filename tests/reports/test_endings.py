"""How the table of a run begins and ends: whole, empty, stopped, cut off, or without a run."""

import pytest

from sphero_probe.reports.rows import Row, finding_row, heading_row
from tests.support.reports_by_hand import (
    HEADING,
    answered,
    rendered,
    run_of,
)

SOME = [answered(1, 0x13, 0x10, 0x00, b"\x57"), answered(2, 0x13, 0x01, 0x05)]


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        pytest.param(run_of([]), "Nothing was asked: the run had no probes.", id="no probes"),
        pytest.param([], "Nothing was asked.", id="no rows"),
        pytest.param(
            run_of([answered(1, 0x13, 0x99, 2)]),
            "1 probe in 1.2 s, 1 frame sent: 0 exist, 1 absent",
            id="all absent",
        ),
        pytest.param(
            run_of(SOME, complete=False),
            "Stopped before the end: what was left has not been asked.",
            id="stopped",
        ),
        pytest.param(
            [heading_row(HEADING), finding_row(SOME[0])],
            "Cut off: the run has no end, so this is not all of it.",
            id="cut off",
        ),
    ],
)
def test_how_a_run_ends(rows: list[Row], expected: str) -> None:
    shown = rendered("table", rows)
    assert shown.splitlines()[-1] == expected


def test_a_finished_run_is_not_called_unfinished() -> None:
    shown = rendered("table", run_of(SOME))
    assert "Stopped" not in shown
    assert "Cut off" not in shown


def test_findings_without_a_run_need_no_end() -> None:
    shown = rendered("table", [finding_row(SOME[0])])
    assert "node 0x11  0x13:0x10  get_battery_percentage  success: percentage 87 %  31.2" in shown
    assert "Cut off" not in shown


def test_strictness_comes_from_the_heading_where_no_note_tells_it() -> None:
    heading = heading_row(
        HEADING._replace(strictness={"primary": "strict", "secondary": "unknown"}, firmware={})
    )
    shown = rendered("table", [heading])
    assert "Length check, primary: strict\nLength check, secondary: unknown\n" in shown
    assert "firmware: not told" in shown
