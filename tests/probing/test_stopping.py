"""A run that is told to end does so within one timeout, wherever it is at that moment."""

import pytest

from sphero_probe.link.pacing import LONGEST_TIMEOUT
from sphero_probe.probing.finding import Summary
from tests.support.strangers.commands import R2
from tests.support.strangers.firmware import Firmware, Voice
from tests.support.strangers.habits import STRANGERS, Stranger
from tests.support.strangers.runs import run

BY_NAME = {stranger.name: stranger for stranger in STRANGERS}
SLOW = Stranger(name="slow", habit="", firmware=Firmware(rows=R2), model="r2d2", voice=Voice(latency=3.0))
MUTE = Stranger(
    name="mute",
    habit="",
    firmware=Firmware(rows=R2),
    model="r2d2",
    voice=Voice(pieces=lambda frame, moment: [] if moment.number > 60 else [frame]),
)
DROPS = Stranger(
    name="drops",
    habit="",
    firmware=Firmware(rows=R2),
    model="r2d2",
    voice=Voice(drops=lambda moment: moment.number % 50 == 49),
)


@pytest.mark.parametrize("at", [0.01, 0.5, 1.5, 3.0, 7.0, 20.0])
@pytest.mark.parametrize(
    ("stranger", "longest"),
    [
        pytest.param(BY_NAME["plain r2"], 0.5, id="plain"),
        pytest.param(SLOW, LONGEST_TIMEOUT, id="answers after three seconds"),
        pytest.param(MUTE, 3.0, id="goes mute, and is waited for"),
        pytest.param(DROPS, 1.0, id="drops its link, and is connected to again"),
    ],
)
def test_a_run_ends_within_one_timeout_of_being_stopped(
    stranger: Stranger, longest: float, at: float
) -> None:
    ran = run(stranger, "sweep", stop_at=at)
    if ran.error is None:
        assert isinstance(ran.records[-1], Summary)
    assert not isinstance(ran.error, TimeoutError)
    assert ran.seconds <= at + longest
