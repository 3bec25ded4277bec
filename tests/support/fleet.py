"""Runs fleets of built-in robots on the virtual clock, for tests."""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from sphero_probe.errors import SpheroProbeError
from sphero_probe.fleet.action import Action
from sphero_probe.fleet.fleet import Fleet
from sphero_probe.fleet.on_robot import RobotOptions
from sphero_probe.fleet.plans import PlanAction, Subject
from sphero_probe.fleet.records import Ended, FleetRecord
from sphero_probe.fleet.robots import FleetRobot, fleet_of
from sphero_probe.link.exchange import Answered
from sphero_probe.link.policy import Consent
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.protocol.packets import Generation
from sphero_probe.runs.resume import RunJournal
from sphero_probe.runs.running import engine_for, records_of
from sphero_probe.session.session import open_session
from sphero_probe.transports.base import BLE_PORT
from tests.support.virtual_clock import run

CIDS = 0x50
Records = dict[str, list[FleetRecord]]
"""Device -> what happened on it."""


def power_plan(_subject: Subject) -> tuple[Plan, dict[str, str]]:
    """The plan of ``sweep --did 0x13 --cid 0x00-0x4f``."""
    return Plan("sweep", "DID 0x13", [list(sweep([0x13], range(CIDS)))]), {"did": "0x13", "cid": "0x00-0x4f"}


SWEEP = PlanAction("sweep", power_plan)


def without_journal(_robot: FleetRobot) -> RunJournal:
    return RunJournal("sweep", off=True)


async def on_fleet(
    devices: Iterable[str],
    action: Action = SWEEP,
    *,
    until: Callable[[FleetRobot, FleetRecord], bool] = lambda *_: False,
    journal_for: Callable[[FleetRobot], RunJournal] = without_journal,
    options: RobotOptions | None = None,
) -> Records:
    """Run an action on a fleet; it is told to stop where ``until`` says so."""
    fleet = Fleet(fleet_of(devices), action, journal_for, options=options)
    records: Records = {robot.device: [] for robot in fleet.robots}
    async for robot, record in fleet.records():
        records[robot.device].append(record)
        if until(robot, record):
            fleet.stop.set()
    return records


def alone(device: str) -> tuple[list[Finding], str]:
    """Sweep one robot as ``sweep`` does; return its findings and the error that ended the run, or nothing."""

    async def work() -> tuple[list[Finding], str]:
        plan, _ = power_plan(Subject(Generation.V2, None, BLE_PORT, None))
        found: list[Finding] = []
        try:
            async with open_session(device, Consent()) as session:
                engine = engine_for(plan, session, session.target, asyncio.Event())
                async for record in records_of(engine, session):
                    found += [record] if isinstance(record, Finding) else []
        except SpheroProbeError as error:
            return found, str(error)
        return found, ""

    return run(work())


def findings_of(records: Sequence[Any]) -> list[Finding]:
    """Return the last finding of each probe, by number, without times."""
    found = {record.number: record for record in records if isinstance(record, Finding)}
    return [_timeless(found[number]) for number in sorted(found)]


def ended(records: Sequence[FleetRecord]) -> Ended:
    """Return how the work on a robot ended."""
    last = records[-1]
    assert isinstance(last, Ended)
    assert sum(isinstance(record, Ended) for record in records) == 1
    return last


def _timeless(finding: Finding) -> Finding:
    exchange = finding.exchange
    return (
        finding._replace(exchange=exchange._replace(rtt=0.0)) if isinstance(exchange, Answered) else finding
    )
