"""How long runs take on the virtual clock where answers are lost: bounded, not a timeout for each probe."""

import pytest

from sphero_probe.probing.finding import Outcome, Summary
from tests.support.strangers.habits import STRANGERS
from tests.support.strangers.runs import run

BY_NAME = {stranger.name: stranger for stranger in STRANGERS}


@pytest.mark.unmeasured
@pytest.mark.parametrize(("name", "most"), [("bb-8 loses calibration", 45.0), ("plain bb-8", 8.0)])
def test_a_sweep_of_256_commands_ends_in_time(name: str, most: float) -> None:
    ran = run(BY_NAME[name], "sweep")
    summary = ran.records[-1]
    assert isinstance(summary, Summary)
    assert summary.complete
    assert summary.counts.get(Outcome.SILENT, 0) == 0
    assert summary.counts.get(Outcome.INCONCLUSIVE, 0) == 0
    assert ran.seconds <= most
