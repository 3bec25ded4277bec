"""Run a plan on each robot of a fleet: ``sweep`` and ``discover``."""

from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing, suppress
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import IncompleteError, LinkLostError
from sphero_probe.fleet.action import Visit
from sphero_probe.fleet.health import read_battery
from sphero_probe.fleet.records import FleetRecord, Progress
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.probing.finding import Finding, Summary
from sphero_probe.probing.plan import Plan
from sphero_probe.protocol.packets import Generation
from sphero_probe.runs.running import engine_for, records_of
from sphero_probe.session.commands import node

INCOMPLETE: Final = "the run is incomplete"
"""The trouble of a run whose summary says so; its records say why."""


class Subject(NamedTuple):
    """What a plan is made for.

    Attributes:
        generation: the robot's protocol.
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
        target: the address byte of the node, None to leave addresses out.
    """

    generation: Generation
    robot: Robot | None
    port: int
    target: int | None


PlanFor = Callable[[Subject], tuple[Plan, dict[str, str]]]
"""Makes a plan, and the options to make it again."""


class PlanAction(NamedTuple):
    """Runs a plan on each robot: ``sweep`` and ``discover``.

    Attributes:
        command: ``sweep`` or ``discover``.
        plan_for: makes the plan for one robot.
        target: the node as typed, None for the usual one.
    """

    command: str
    plan_for: PlanFor
    target: str | None = None

    def plan_on(self, _robot: FleetRobot, subject: Subject) -> Plan:
        """Return the plan for one robot.

        Raises:
            SpheroProbeError: there is none for this robot.
        """
        return self.plan_for(subject)[0]

    async def run(self, visit: Visit) -> AsyncGenerator[FleetRecord, None]:
        """Run the plan, then read the battery, which the report shows; yield the records of both."""
        _, session, journal, stop = visit
        connection, consent = session.connection, session.link.policy.consent
        robot, port = connection.robot, connection.port
        plan, options = self.plan_for(
            Subject(connection.generation, robot, port, node(self.target, robot, port))
        )
        journal.options = options
        target = journal.check(plan, consent, self.target)
        journal.begin(connection, plan, consent, target)
        engine = engine_for(plan, session, node(target, robot, port), stop, journal)
        total, complete = 0, False
        async with aclosing(records_of(engine, session)) as records:
            async for record in records:
                yield record
                if isinstance(record, Finding) and engine.total != total:
                    total = engine.total
                    yield Progress(total)
                complete = isinstance(record, Summary) and record.complete
        if not stop.is_set():
            with suppress(LinkLostError):  # the run has ended before
                yield await read_battery(session)
        if not complete:
            raise IncompleteError(INCOMPLETE)
