"""A plan and a link in, records out: each probe that safety lets through is asked and yields one finding."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Protocol

from sphero_probe import __version__
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered, Aside, Late, Silent
from sphero_probe.link.link import Link
from sphero_probe.probing.asking import ATTEMPTS, Asked, Asker, Tried
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.probing.judge import finding_of
from sphero_probe.probing.notes import calibration_note, node_name, note_of
from sphero_probe.probing.plan import Plan, Probe, probes_of


@dataclass(slots=True)
class _Unanswered:
    """A probe that is waiting to be asked again."""

    asked: Asked
    silent: Silent
    attempts: int
    belated: Answered | None = None


class Recorder(Protocol):
    """Who keeps what a run intends and finds, so that nothing answered is lost."""

    def intend(self, asked: Asked) -> None:
        """Take in that a probe is about to be sent."""
        ...

    def record(self, record: Record) -> None:
        """Take in what came to light."""
        ...


class _Forgetful:
    """Keeps nothing."""

    def intend(self, asked: Asked) -> None:
        """Forget it."""

    def record(self, record: Record) -> None:
        """Forget it."""


@dataclass(frozen=True, slots=True)
class Earlier:
    """What an interrupted run of the same plan on the same robot left behind.

    Attributes:
        findings: number -> what was settled; it is not asked again.
        doubtful: numbers of probes that went out and were never settled; above the ``probe`` class they are
            not sent again, for they may have been executed.
    """

    findings: Mapping[int, Finding] = field(default_factory=dict)
    doubtful: frozenset[int] = frozenset()


@dataclass(slots=True)
class Run:
    """One plan asked of one robot.

    Attributes:
        plan: what to ask.
        link: whom.
        device: the robot's name or address, for the heading.
        target: the node for probes that name none; None leaves addresses out.
        stop: set it to send nothing more and end after what is in flight.
        recorder: told of every intent and record as it happens.
        earlier: what an interrupted run already settled.
        findings: so far, in the order they were settled.
        total: probes made known so far, for progress.
    """

    plan: Plan
    link: Link
    device: str
    target: int | None = None
    stop: asyncio.Event = field(default_factory=asyncio.Event)
    recorder: Recorder = field(default_factory=_Forgetful)
    earlier: Earlier = field(default_factory=Earlier)
    findings: list[Finding] = field(default_factory=list)
    total: int = 0
    _asker: Asker = field(init=False)
    _asides: list[Note] = field(default_factory=list)
    _in_flight: dict[asyncio.Task[Tried], Asked] = field(default_factory=dict)
    _unanswered: dict[int, _Unanswered] = field(default_factory=dict)
    _lost: LinkLostError | None = None

    def __post_init__(self) -> None:
        self._asker = Asker(self.link, self.target)
        self._asker.intend = self.recorder.intend

    async def records(self) -> AsyncIterator[Record]:
        """Yield every record of the run, each after the recorder has it.

        Raises:
            LinkLostError: the robot is gone; a summary that says so came first.
            BadInputFileError: a stage of the plan is broken.
        """
        async for record in self._records():
            self.recorder.record(record)
            yield record

    async def _records(self) -> AsyncIterator[Record]:
        """Yield a heading, then findings and notes as they come, then a summary."""
        loop = asyncio.get_running_loop()
        began, frames_before = loop.time(), self.link.frames_sent
        self.link.on_aside = self._hear_aside
        try:
            for index, stage in enumerate(self.plan.stages):
                if self.stop.is_set() or self._lost:
                    break
                probes = probes_of(self.plan, stage, tuple(self.findings))
                if index == 0:
                    for record in await self._introduction(probes):
                        yield record
                async for record in self._stage(probes):
                    if isinstance(record, Finding):
                        self.findings.append(record)
                    yield record
        except LinkLostError as error:
            self._lost = error
        finally:
            for task in self._in_flight:
                task.cancel()
            await asyncio.gather(*self._in_flight, return_exceptions=True)
        for note in self._take_asides():
            yield note
        yield Summary(
            dict(Counter(finding.outcome for finding in self.findings)),
            loop.time() - began,
            self.link.frames_sent - frames_before,
            complete=self._lost is None and not self.stop.is_set(),
        )
        if self._lost:
            raise self._lost

    async def _introduction(self, probes: Sequence[Probe]) -> list[Record]:
        """Call on the robot and measure the nodes that the first probes need; say what was seen."""
        robot = self.link.guard.robot
        firmware = await self._asker.identify()
        open_ = [probe for number, probe in enumerate(probes, 1) if number not in self.earlier.findings]
        profiles = await self._asker.calibrate_for(open_)
        heading = Heading(
            robot=robot.key if robot else "",
            model=robot.name if robot else "unknown model",
            device=self.device,
            firmware=firmware,
            plan=self.plan.name,
            tool_version=__version__,
            consent=self.link.guard.consent.words,
            strictness={node_name(profile.target, robot): profile.strictness for profile in profiles},
            started=datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z"),
        )
        notes = [calibration_note(profile, robot) for profile in profiles]
        return [heading, *notes, *self._take_asides()]

    async def _stage(self, probes: Sequence[Probe]) -> AsyncIterator[Record]:
        """Ask the probes of one stage, several in flight; then the silent ones again, alone."""
        first = self.total + 1
        self.total += len(probes)
        try:
            async for record in self._ask_all(probes, first):
                yield record
            async for record in self._ask_again():
                yield record
        except LinkLostError as error:
            self._lost = error
        for unanswered in self._unanswered.values():
            yield self._last_word(unanswered)
        self._unanswered.clear()

    async def _ask_all(self, probes: Sequence[Probe], first: int) -> AsyncIterator[Record]:
        for number, probe in enumerate(probes, first):
            if self.stop.is_set() or self._lost:
                break
            if settled := self._settled_earlier(number, probe):
                yield settled
                continue
            asked, measured = await self._asker.prepare(number, probe)
            if measured:
                yield calibration_note(measured, self.link.guard.robot)
            self._in_flight[asyncio.create_task(self._asker.ask(asked))] = asked
            while len(self._in_flight) >= self.link.window:
                for record in await self._collect():
                    yield record
        while self._in_flight:
            for record in await self._collect():
                yield record

    def _settled_earlier(self, number: int, probe: Probe) -> Finding | None:
        """Return what an interrupted run found out about this very probe, None where it is to be asked."""
        finding = self.earlier.findings.get(number)
        if finding and finding.command[:2] == probe.command[:2]:
            return finding
        if number in self.earlier.doubtful:
            asked = self._asker.complete(number, probe)
            if asked.risk > Risk.PROBE:
                unasked = Silent(asked.command, 0, b"", 0.0)
                note = "sent before the run was interrupted, may have been executed: not sent again"
                found = self._finding(asked, Tried(unasked, 1))
                return found._replace(outcome=Outcome.INCONCLUSIVE, note=note)
        return None

    async def _collect(self) -> list[Record]:
        """Wait for at least one probe in flight and return what it brought to light."""
        done, _ = await asyncio.wait(self._in_flight, return_when=asyncio.FIRST_COMPLETED)
        records: list[Record] = []
        for task in sorted(done, key=lambda task: self._in_flight[task].number):
            asked = self._in_flight.pop(task)
            try:
                exchange, attempts = task.result()
            except LinkLostError as error:
                self._lost = error
                unasked = Silent(asked.command, 0, b"", 0.0)
                self._unanswered[asked.number] = _Unanswered(asked, unasked, 1)
                continue
            if isinstance(exchange, Silent):
                self._unanswered[asked.number] = _Unanswered(asked, exchange, attempts)
            else:
                records.append(self._finding(asked, Tried(exchange, attempts)))
        return [*self._take_asides(), *records]

    async def _ask_again(self) -> AsyncIterator[Record]:
        """Ask what was silent again, alone: too wide a window invents silence."""
        for _ in range(ATTEMPTS - 1):
            for number, unanswered in sorted(self._unanswered.items()):
                if self.stop.is_set() or self._lost:
                    return
                if unanswered.belated or unanswered.asked.risk > Risk.WRITE:
                    continue
                exchange, attempts = await self._asker.ask(unanswered.asked, alone=True)
                unanswered.attempts += attempts
                if isinstance(exchange, Silent):
                    unanswered.silent = exchange
                else:
                    del self._unanswered[number]
                    yield self._finding(unanswered.asked, Tried(exchange, unanswered.attempts))

    def _last_word(self, unanswered: _Unanswered) -> Finding:
        """Return the finding of a probe that stayed without an answer in time."""
        asked, attempts = unanswered.asked, unanswered.attempts
        if unanswered.belated:
            return self._finding(asked, Tried(unanswered.belated, attempts))
        finding = self._finding(asked, Tried(unanswered.silent, attempts))
        if attempts >= ATTEMPTS:
            return finding
        note = "asked once only: its class is not repeated"
        if self._lost:
            note = "the link was lost before it was settled"
        elif self.stop.is_set():
            note = "stopped before it was asked again"
        return finding._replace(outcome=Outcome.INCONCLUSIVE, note=note)

    def _finding(self, asked: Asked, tried: Tried) -> Finding:
        return finding_of(asked, tried, self.link.codec, masked=self._asker.masks(asked.command.target))

    def _hear_aside(self, aside: Aside) -> None:
        """Keep what was said besides; a late answer still settles its own probe."""
        if isinstance(aside, Late) and isinstance(aside.earlier, Silent):
            for unanswered in self._unanswered.values():
                if unanswered.silent is aside.earlier:
                    command, seq, sent, waited = aside.earlier
                    unanswered.belated = Answered(command, seq, sent, aside.response, aside.received, waited)
        self._asides.append(note_of(aside, self.link.codec, self.link.guard.robot))

    def _take_asides(self) -> list[Note]:
        taken, self._asides = self._asides, []
        return taken
