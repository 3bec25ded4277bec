"""Do one action on one robot: wait for an adapter, connect, act, and say how it ended."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import AsyncExitStack, aclosing, asynccontextmanager, nullcontext
from itertools import count
from typing import Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import (
    ConnectionFailedError,
    IncompleteError,
    LastingFailureError,
    LinkLostError,
    NoAnswerError,
    RefusedByPolicyError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
)
from sphero_probe.fleet.action import Action, Visit
from sphero_probe.fleet.adapters import Adapter, Adapters
from sphero_probe.fleet.records import Ended, FleetRecord, Reached, Status, Step
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.link.policy import Consent
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.addressing import address_of
from sphero_probe.session.session import open_session
from sphero_probe.transports.base import Connection, OpenOptions

PAUSES: Final = (1.0,)
"""Seconds before each further attempt to connect; the transport repeats an attempt by itself, too."""
_STOPPED: Final = "stopped before it was connected"
_UNREACHED: Final = (RobotNotFoundError, ConnectionFailedError, UnavailableError)


class FleetConsent(NamedTuple):
    """What may be sent to the robots of a fleet.

    Attributes:
        allowed: risk classes, for every robot.
        confirmed: the names of the robots for which the class ``brick`` is confirmed.
    """

    allowed: frozenset[Risk] = Consent().allowed
    confirmed: frozenset[str] = frozenset()

    def for_robot(self, name: str) -> Consent:
        """Return the consent for one robot.

        Args:
            name: as it advertises.

        Raises:
            RefusedByPolicyError: the class ``brick`` is allowed and not confirmed for this robot.
        """
        if Risk.BRICK not in self.allowed:
            return Consent(self.allowed)
        if name not in self.confirmed:
            raise RefusedByPolicyError(
                f"the class brick is not confirmed for {name}",
                f"to allow it on this robot, too, write --confirm {name}",
            )
        return Consent(self.allowed, name)


class RobotOptions(NamedTuple):
    """How to connect to each robot of a fleet, and what it may be sent.

    Attributes:
        consent: what may be sent.
        connect_timeout: seconds for scanning, and for each step of connecting.
        timeout: seconds until a command counts as silent, None to measure it.
        tolerate: in what an answer may differ and still count.
    """

    consent: FleetConsent = FleetConsent()
    connect_timeout: float = 10.0
    timeout: float | None = None
    tolerate: tuple[str, ...] = ()


async def run_on_robot(
    robot: FleetRobot,
    action: Action,
    options: RobotOptions,
    adapters: Adapters,
    journal: RunJournal,
    stop: asyncio.Event,
    on_step: Callable[[str], None] = lambda _: None,
) -> AsyncGenerator[FleetRecord, None]:
    """Do an action on one robot and yield what happens; the last record is an ``Ended``.

    Whatever goes wrong on the robot is told by the ``Ended``. Setting ``stop`` ends a run once nothing is in
    flight, and gives up a robot that is not connected yet. Closing the generator disconnects.

    Args:
        robot: which.
        action: what to do.
        options: how to connect, and what may be sent.
        adapters: shared by all robots of this process.
        journal: of this robot, not entered yet.
        stop: ends the work politely.
        on_step: called with the name of each step as it begins, from within the work.
    """
    reached = False
    try:
        with journal:
            async with AsyncExitStack() as opened:
                yield Step("wait")
                async with _given_up_at(stop):
                    adapter, connection = await _reach(opened, robot, options, adapters, on_step)
                reached = True
                model = connection.robot.name if connection.robot else "unknown model"
                yield Reached(
                    *(connection.name, model, connection.generation, connection.address, adapter.name)
                )
                session = await opened.enter_async_context(
                    open_session(
                        robot.device,
                        options.consent.for_robot(connection.name),
                        OpenOptions(options.connect_timeout, adapter.name, on_step),
                        timeout=options.timeout,
                        tolerate=options.tolerate,
                        opened=nullcontext(connection),
                    )
                )
                visit = Visit(robot, session, journal, stop)
                async with aclosing(action.run(visit)) as records:
                    async for record in records:
                        yield record
        yield Ended(Status.DONE, journal=journal.place)
    except SpheroProbeError as error:
        yield Ended(status_of(error, reached=reached), str(error), error.hint, journal.place)


def status_of(error: SpheroProbeError, *, reached: bool) -> Status:
    """Return how the work on a robot ended that raised an error.

    Args:
        error: what it raised.
        reached: the robot was connected.
    """
    if isinstance(error, RefusedByPolicyError):
        return Status.REFUSED
    if isinstance(error, IncompleteError) or (isinstance(error, LinkLostError) and reached):
        return Status.INCOMPLETE
    if isinstance(error, NoAnswerError) or (isinstance(error, _UNREACHED) and not reached):
        return Status.UNREACHABLE
    return Status.FAILED


@asynccontextmanager
async def _given_up_at(stop: asyncio.Event) -> AsyncIterator[None]:
    """Interrupt what the block waits for once ``stop`` is set.

    Raises:
        IncompleteError: it was interrupted.
    """
    loop = asyncio.get_running_loop()
    limit = asyncio.timeout(None)

    async def watch() -> None:
        await stop.wait()
        limit.reschedule(loop.time())

    try:
        async with limit:
            watching = asyncio.create_task(watch(), name="stop watcher")
            try:
                yield
            finally:
                watching.cancel()
    except TimeoutError as error:
        raise IncompleteError(_STOPPED) from error


async def _reach(
    opened: AsyncExitStack,
    robot: FleetRobot,
    options: RobotOptions,
    adapters: Adapters,
    on_step: Callable[[str], None],
) -> tuple[Adapter, Connection]:
    """Connect, with a place on an adapter; ``opened`` gives both back.

    A robot that cannot be connected gives its place to others before it is tried again.

    Raises:
        SpheroProbeError: the robot cannot be reached.
    """
    address = address_of(robot.device)
    opening = OpenOptions(options.connect_timeout, on_step=on_step)
    for attempt in count():
        async with AsyncExitStack() as trying:
            adapter = await trying.enter_async_context(adapters.place(address))
            try:
                connection = await trying.enter_async_context(adapter.open(address, opening))
            except LastingFailureError:
                raise
            except (RobotNotFoundError, ConnectionFailedError) as error:
                if attempt == len(PAUSES):
                    raise
                on_step(f"try again: {error}")
            else:
                await opened.enter_async_context(trying.pop_all())
                return adapter, connection
        await asyncio.sleep(PAUSES[attempt])
    raise AssertionError("counting does not end")
