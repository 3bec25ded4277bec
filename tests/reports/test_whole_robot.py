"""The HTML page of a run with 65,536 findings: its size stays within bounds, whatever the robot answers."""

import io
from collections.abc import Callable

import pytest

from sphero_probe.reports import views
from sphero_probe.reports.registry import Style, open_report
from sphero_probe.reports.rows import Row, finding_row, heading_row
from tests.support.reports_by_hand import HEADING, answered

pytestmark = pytest.mark.slow

SUCCESS = finding_row(answered(1, 0x80, 0x80, 0x00, bytes(16))).data
REJECTED = finding_row(answered(1, 0x80, 0x80, 0x05)).data
ABSENT = finding_row(answered(1, 0x80, 0x80, 0x02)).data


def different(did: int, cid: int) -> dict[str, object]:
    """Every command exists and says something else."""
    return SUCCESS | {"payload": f"{did:02x}{cid:02x}" * 8}


def mixed(did: int, cid: int) -> dict[str, object]:
    """No two neighbours are alike, so that ids make no ranges."""
    return REJECTED if (did + cid) % 2 else ABSENT


@pytest.mark.parametrize("answer", [different, mixed])
def test_a_page_of_everything_is_small_enough(answer: Callable[[int, int], dict[str, object]]) -> None:
    out = io.StringIO()
    report = open_report("html", out, view=views.FINDINGS, style=Style())
    report.add(heading_row(HEADING))
    for number in range(1 << 16):
        did, cid = divmod(number, 256)
        ids = {"number": number + 1, "did": did, "cid": cid}
        report.add(Row("finding", answer(did, cid) | ids))
    report.close()
    page = out.getvalue()
    assert 3_000_000 <= len(page) <= 6_000_000
    assert page.count("<article ") == 256
    assert page.count("<td ") >= 1 << 16
    assert "are too many for this page" in page
