"""Run a plan on an open session, with its journal; whatever ends it, the motors are stopped at the end."""

import asyncio
from collections.abc import AsyncGenerator
from contextlib import aclosing, suppress

from sphero_probe.errors import LinkLostError
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Record
from sphero_probe.probing.oneshot import stop_motors
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.recorder import NullRecorder, PreviousResults, Recorder
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.session import Session


def engine_for(
    plan: Plan,
    session: Session,
    target: int | None,
    stop: asyncio.Event,
    journal: RunJournal | None = None,
    *,
    recorder: Recorder | None = None,
) -> Engine:
    """Return the engine that runs a plan on a session, and resumes what its journal holds.

    Args:
        plan: what to ask.
        session: with the robot.
        target: the address byte of the node for probes that name none.
        stop: set it to end the run once nothing is in flight.
        journal: of the run, begun; None to keep none.
        recorder: what records the run, None for the journal.
    """
    return Engine(
        *(plan, session.link, session.connection.name, target, stop),
        recorder=recorder or journal or NullRecorder(),
        announce=journal.announce if journal else None,
        earlier=journal.earlier if journal else PreviousResults(),
        reconnect=session.reconnect,
        line=session.connection.line,
        on_step=session.on_step,
    )


async def records_of(engine: Engine, session: Session) -> AsyncGenerator[Record, None]:
    """Yield the records of a run, then stop the motors, however the run ends.

    Raises:
        SpheroProbeError: as ``Engine.records`` does.
    """
    try:
        async with aclosing(engine.records()) as records:  # type: ignore[type-var]
            async for record in records:
                yield record
    finally:
        with suppress(LinkLostError):
            await stop_motors(session.link, engine.target)
