"""Many robots at once: each as if it were alone, whatever happens to the others."""

from contextlib import aclosing

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import UsageError
from sphero_probe.fleet.fleet import Fleet
from sphero_probe.fleet.on_robot import FleetConsent, RobotOptions
from sphero_probe.fleet.records import Battery, Reached, Status
from sphero_probe.fleet.robots import FleetRobot, fleet_of
from sphero_probe.probing.finding import Finding, Heading, Outcome, Summary
from sphero_probe.runs.resume import RunJournal
from tests.support.fleet import CIDS, SWEEP, alone, ended, findings_of, on_fleet, without_journal
from tests.support.virtual_clock import run

GOOD = tuple(f"fake:bolt-plus?seed={seed}&hidden=9&interval=15ms" for seed in range(5))
GOOD += ("fake:rvr?seed=5&interval=30ms", "fake:mini?seed=6&interval=30ms")
SILENT = "fake:bolt-plus?seed=7&loss=1"
DROPPING = "fake:bolt-plus?seed=8&disconnect_after=2&interval=15ms"
REBOOTING = "fake:bolt-plus?seed=9&reboot_on=0x13:0x40&interval=15ms"


def test_seven_robots_give_what_each_gives_alone_beside_three_that_misbehave() -> None:
    records = run(on_fleet([*GOOD, SILENT, DROPPING, REBOOTING]))
    for device in GOOD:
        found, trouble = alone(device)
        assert not trouble
        assert findings_of(records[device]) == findings_of(found), device
        assert ended(records[device]).status is Status.DONE
        assert len(findings_of(records[device])) == CIDS
    assert ended(records[SILENT]).status is Status.UNREACHABLE
    assert ended(records[SILENT]).trouble == alone(SILENT)[1]
    assert ended(records[DROPPING]).status is Status.INCOMPLETE
    assert ended(records[DROPPING]).trouble == alone(DROPPING)[1]
    assert findings_of(records[REBOOTING]) == findings_of(alone(REBOOTING)[0])
    (doubtful,) = (one for one in findings_of(records[REBOOTING]) if one.outcome is Outcome.INCONCLUSIVE)
    assert doubtful.command.cid == 0x40


def test_each_robot_tells_who_it_is_before_its_run_and_its_battery_after_it() -> None:
    (records,) = run(on_fleet(["fake:bolt-plus?seed=1"])).values()
    kinds = [type(record) for record in records if isinstance(record, Reached | Heading | Summary | Battery)]
    assert kinds == [Reached, Heading, Summary, Battery]
    (battery,) = (record for record in records if isinstance(record, Battery))
    assert {fact.name for fact in battery.facts} == {"battery_percentage", "battery_voltage_state"}


def test_stop_ends_every_run_cleanly_and_gives_up_robots_that_wait() -> None:
    seen: list[Finding] = []

    def after_ten(_robot: FleetRobot, record: object) -> bool:
        seen.extend([record] if isinstance(record, Finding) else [])
        return len(seen) == 10

    records = run(on_fleet(GOOD, until=after_ten))
    for told in records.values():
        assert ended(told).status is Status.INCOMPLETE
        assert not any(isinstance(record, Battery) for record in told)
    assert sum(len(findings_of(told)) for told in records.values()) < len(GOOD) * CIDS


def test_leaving_the_loop_ends_every_run() -> None:
    async def work() -> int:
        fleet = Fleet(fleet_of(GOOD), SWEEP, without_journal)
        async with aclosing(fleet.records()) as records:
            number = 0
            async for _ in records:
                number += 1
                if number == 50:
                    break
        return number

    assert run(work()) == 50  # the virtual clock fails a test that leaves tasks behind


def test_a_bug_on_one_robot_is_raised_after_the_others_have_ended() -> None:
    def journal_for(robot: FleetRobot) -> RunJournal:
        journal = without_journal(robot)
        if robot.device == GOOD[0]:
            journal.check = None  # type: ignore[method-assign,assignment]
        return journal

    done: list[str] = []

    def note_end(robot: FleetRobot, record: object) -> bool:
        if isinstance(record, Summary) and record.complete:
            done.append(robot.device)
        return False

    with pytest.raises(TypeError):
        run(on_fleet(GOOD[:3], until=note_end, journal_for=journal_for))
    assert sorted(done) == sorted(GOOD[1:3])


def test_brick_is_confirmed_for_each_robot_and_refused_on_the_others_before_anything_is_sent() -> None:
    devices = ["fake:bolt-plus?seed=1", "fake:bolt-plus?seed=2"]
    met = run(on_fleet(devices))
    names = [record.name for told in met.values() for record in told if isinstance(record, Reached)]
    consent = FleetConsent(frozenset({Risk.READ, Risk.PROBE, Risk.BRICK}), frozenset({names[0]}))
    records = run(on_fleet(devices, options=RobotOptions(consent)))
    assert any(one.risk is Risk.BRICK for one in findings_of(records[devices[0]]) if one.attempts)
    refused = ended(records[devices[1]])
    assert (refused.status, names[1] in refused.trouble) == (Status.REFUSED, True)
    assert not any(isinstance(record, Heading | Finding) for record in records[devices[1]])


@pytest.mark.parametrize(
    "devices",
    [[], ["fake:bolt-plus", "fake:bolt-plus"], ["BP-1234", "ble:BP-1234"], ["fake:bolt-plus?seed=x"]],
)
def test_a_fleet_that_is_none(devices: list[str]) -> None:
    with pytest.raises(UsageError):
        fleet_of(devices)
