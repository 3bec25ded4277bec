"""A running plan: iterate over its findings, or collect them."""

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import aclosing, suppress
from pathlib import Path
from typing import Any, NamedTuple
from weakref import ReferenceType, ref

from sphero_probe.api.notifications import Dispatcher
from sphero_probe.api.result import Run
from sphero_probe.probing.finding import Finding, Heading, Note, Record, Summary
from sphero_probe.probing.plan import Plan
from sphero_probe.runs.resume import RunJournal
from sphero_probe.runs.running import engine_for, records_of
from sphero_probe.session.session import Session


class Asked(NamedTuple):
    """What a running plan does.

    Attributes:
        command: the name of the command on the command line: ``sweep`` or ``discover``.
        plan: the probes.
        target: the address byte of the node for probes that name none.
        options: what ``sphero-probe … --resume`` needs to rebuild the plan.
        journal: the file of a new journal; None keeps none.
    """

    command: str
    plan: Plan
    target: int | None
    options: dict[str, str]
    journal: Path | str | None = None


Records = AsyncGenerator[Any, None]
"""Yields records of a run, or findings only."""


class OpenRuns:
    """The plan that runs on one session, one at a time, so that closing the connection can end it."""

    def __init__(self, session: Session, dispatcher: Dispatcher) -> None:
        self.session = session
        self._dispatcher = dispatcher
        self._stop: Callable[[], None] = lambda: None
        self._records: Callable[[], Records | None] = lambda: None
        self._ended = asyncio.Event()
        self._ended.set()

    async def begin(self, stop: Callable[[], None], records: Callable[[], Records | None]) -> None:
        """Wait until the previous plan, whose loop was left, has ended; then note that a new one starts.

        Args:
            stop: makes the new plan stop sending.
            records: returns its generator, None once its loop was left.

        Raises:
            RuntimeError: a plan is still running.
        """
        if not self._ended.is_set() and self._records() is not None:
            raise RuntimeError("a plan is running on this robot: end its loop first")
        await self._ended.wait()
        self._ended.clear()
        self._stop, self._records = stop, records
        self._dispatcher.link_may_change()

    def end(self) -> None:
        """Note that the plan has ended, with nothing in flight."""
        self._dispatcher.link_stands()
        self._ended.set()

    async def close(self) -> None:
        """End the plan, whether its loop was left or is still running."""
        if self._ended.is_set():
            return
        self._stop()
        if records := self._records():
            with suppress(RuntimeError):  # another task waits in it: it ends early, or with LinkLostError
                await records.aclose()
        else:  # the event loop is closing it
            await self._ended.wait()


class RunningPlan:
    """A plan that runs while you iterate over it, once.

    ``async for finding in running`` yields one finding per probe as soon as it is certain; ``await
    running.collect()`` returns the whole ``Run``. Leaving the loop early, or cancelling the task, ends the
    run; nothing stays in flight. If the link drops, the run reconnects, as on the command line.
    """

    def __init__(self, runs: OpenRuns, asked: Asked) -> None:
        self._runs = runs
        self._asked = asked
        self._stop = asyncio.Event()
        self._started = False
        self._heading: Heading | None = None
        self._findings: dict[int, Finding] = {}
        self._notes: list[Note] = []
        self._summary: Summary | None = None

    @property
    def plan(self) -> Plan:
        """The plan that runs."""
        return self._asked.plan

    @property
    def result(self) -> Run:
        """The results so far; complete once the loop has ended."""
        findings = tuple(finding for _, finding in sorted(self._findings.items()))
        return Run(self._heading, findings, tuple(self._notes), self._summary)

    def stop(self) -> None:
        """Stop sending; the loop ends after the probes in flight, with an incomplete summary."""
        self._stop.set()

    def __aiter__(self) -> AsyncIterator[Finding]:
        """Run the plan and yield its findings.

        Raises:
            NoAnswerError: the robot never answered.
            LinkLostError: the connection is lost; ``result`` has the findings up to then.
            BadInputFileError: a stage of the plan is broken.
            OutputError: the journal cannot be written, or its file is not empty.
            RuntimeError: the plan was run before.
        """
        return self._iterate(lambda record: isinstance(record, Finding))

    def records(self) -> AsyncIterator[Record]:
        """Run the plan and yield everything: a heading, findings and notes as they arrive, a summary.

        Raises:
            SpheroProbeError: as iterating over the findings does.
        """
        return self._iterate(lambda _: True)

    async def collect(self) -> Run:
        """Run the plan to its end and return the results.

        Raises:
            SpheroProbeError: as iterating does; ``result`` has the findings up to then.
        """
        async for _ in self.records():
            pass
        return self.result

    def _iterate(self, wanted: Callable[[Record], bool]) -> Records:
        if self._started:
            raise RuntimeError("this plan has been run: make a new one with robot.sweep() or robot.run()")
        self._started = True
        made: list[ReferenceType[Records]] = []
        records = self._run(wanted, lambda: made[0]())  # noqa: PLW0108 - it is not there yet
        made.append(ref(records))
        return records

    async def _run(self, wanted: Callable[[Record], bool], own: Callable[[], Records | None]) -> Records:
        asked, session = self._asked, self._runs.session
        off = asked.journal is None
        keeper = RunJournal(asked.command, file=None if off else str(asked.journal), off=off)
        keeper.options = asked.options
        await self._runs.begin(self.stop, own)
        try:
            with keeper:
                target = None if asked.target is None else f"0x{asked.target:02x}"
                keeper.begin(session.connection, asked.plan, session.link.policy.consent, target)
                engine = engine_for(asked.plan, session, asked.target, self._stop, keeper)
                async with aclosing(records_of(engine, session)) as records:
                    async for record in records:
                        self._keep(record)
                        if wanted(record):
                            yield record
        finally:
            self._runs.end()

    def _keep(self, record: Record) -> None:
        match record:
            case Heading():
                self._heading = record
            case Finding():
                self._findings[record.number] = record
            case Note():
                self._notes.append(record)
            case Summary():
                self._summary = record
