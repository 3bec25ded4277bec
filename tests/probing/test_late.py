"""Late answers: one command that alone answers late is not silent, and a slow robot is not mute."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from sphero_probe.probing.finding import Note, Outcome, Summary
from tests.support.strangers.commands import R2
from tests.support.strangers.firmware import Firmware, Moment, Voice
from tests.support.strangers.habits import Stranger
from tests.support.strangers.robot import Robot
from tests.support.strangers.runs import ABSENT_DEVICES, Ran, run, triple_of

PLAIN = Stranger(name="late", habit="", firmware=Firmware(rows=R2), model="r2d2", voice=Voice(), few=True)


def late(stranger: Stranger, pair: tuple[int, int], seconds: float, *, first_only: bool) -> Stranger:
    """Return a stranger that answers one command late: each time that it is asked, or only the first."""

    def delay(moment: Moment) -> float:
        return seconds if moment.pair == pair and (moment.attempt == 1 or not first_only) else 0.0

    return replace(stranger, voice=replace(stranger.voice, late=delay))


def probed() -> Sequence[tuple[int, int]]:
    """Return the pairs of a sweep in the order of their numbers."""
    findings = sorted(run(PLAIN, "sweep").findings)
    return [finding.command[:2] for finding in findings if finding.outcome is not Outcome.SKIPPED]


def silences(ran: Ran) -> list[tuple[int, int, int]]:
    answered = {heard[1:4] for heard in ran.robot.heard if heard.said is not None}
    return [
        triple_of(finding)
        for finding in ran.findings
        if finding.outcome is Outcome.SILENT and triple_of(finding) in answered
    ]


@pytest.mark.unmeasured
@pytest.mark.parametrize("first_only", [True, False], ids=["once", "always"])
@pytest.mark.parametrize("place", ["first", "middle", "last"])
@pytest.mark.parametrize("seconds", [0.4, 0.6, 0.9, 1.5, 3.0, 4.9])
def test_a_command_that_alone_answers_late_is_never_silent(
    seconds: float, place: str, first_only: bool
) -> None:
    pairs = probed()
    assert len(pairs) >= 40
    pair = {"first": pairs[0], "middle": pairs[len(pairs) // 2], "last": pairs[-1]}[place]
    ran = run(late(PLAIN, pair, seconds, first_only=first_only), "sweep")
    assert ran.error is None
    assert silences(ran) == []
    truth = Robot(PLAIN.firmware, PLAIN.voice).truth
    found = next(finding for finding in ran.findings if finding.command[:2] == pair)
    assert found.outcome is (Outcome.EXISTS if triple_of(found) in truth else Outcome.ABSENT)


@pytest.mark.unmeasured
@pytest.mark.parametrize("seconds", [2.0, 3.2, 5.0])
def test_a_robot_whose_every_answer_takes_long_is_slow_and_not_mute(seconds: float) -> None:
    ran = run(replace(PLAIN, voice=Voice(latency=seconds)), "sweep")
    assert ran.error is None
    assert isinstance(ran.records[-1], Summary)
    assert ran.records[-1].complete
    assert silences(ran) == []
    (note,) = [record for record in ran.records if isinstance(record, Note) and record.kind == "run"]
    assert note.text == f"answers take {seconds:.1f} s: waiting up to 10 s for each"


def test_a_quick_robot_is_not_called_slow() -> None:
    ran = run(PLAIN, "sweep")
    assert not [record for record in ran.records if isinstance(record, Note) and record.kind == "run"]
    assert {finding.command.did for finding in ran.findings} >= set(ABSENT_DEVICES)
