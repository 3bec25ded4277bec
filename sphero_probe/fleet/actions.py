"""What a fleet can do on each robot: the interface, and running a plan."""

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing, suppress
from typing import NamedTuple, Protocol

from sphero_probe.errors import IncompleteError, LinkLostError
from sphero_probe.fleet.health import read_battery
from sphero_probe.fleet.records import FleetRecord, Progress
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.probing.finding import Finding, Summary
from sphero_probe.probing.plan import Plan
from sphero_probe.protocol.packets import Generation
from sphero_probe.runs.resume import RunJournal
from sphero_probe.runs.running import engine_for, records_of
from sphero_probe.session.commands import node
from sphero_probe.session.session import Session

PlanFor = Callable[[Generation, int | None], tuple[Plan, dict[str, str]]]
"""Makes a plan for a protocol and the address byte of the node, and the options to make it again."""


class Visit(NamedTuple):
    """An action meets one robot.

    Attributes:
        robot: which.
        session: with it, open.
        journal: of the run, entered; it may keep nothing.
        stop: set when the action must end.
    """

    robot: FleetRobot
    session: Session
    journal: RunJournal
    stop: asyncio.Event


class Action(Protocol):
    """One action of a fleet. It is a value, so that it can be sent to another process."""

    @property
    def command(self) -> str:
        """The command whose journals it writes: ``sweep``, ``discover``, ``led``; empty if it writes none."""
        ...

    def run(self, visit: Visit) -> AsyncGenerator[FleetRecord, None]:
        """Yield what happens on one robot.

        Raises:
            IncompleteError: part of the result is missing.
            SpheroProbeError: something else went wrong.
        """
        ...


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

    async def run(self, visit: Visit) -> AsyncGenerator[FleetRecord, None]:
        """Run the plan, then read the battery, which the report shows; yield the records of both."""
        _, session, journal, stop = visit
        connection, consent = session.connection, session.link.policy.consent
        plan, options = self.plan_for(
            connection.generation, node(self.target, connection.robot, connection.port)
        )
        journal.options = options
        target = journal.check(plan, consent, self.target)
        journal.begin(connection, plan, consent, target)
        engine = engine_for(plan, session, node(target, connection.robot, connection.port), stop, journal)
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
            raise IncompleteError("the run is incomplete")
