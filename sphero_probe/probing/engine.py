"""Run one plan on one robot. ``Engine`` is the main class of the package."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Final

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.events import ExchangeEnded
from sphero_probe.link.exchange import LateResponse, Unsolicited
from sphero_probe.link.link import Link
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.probing.attempt import Announce, PreparedProbe
from sphero_probe.probing.calibrator import Calibrator, Wanted
from sphero_probe.probing.comparison import comparisons
from sphero_probe.probing.exchange_notes import exchange_notes, exchanges_kept
from sphero_probe.probing.executions import Executions
from sphero_probe.probing.finding import Finding, Note, Outcome, Record, Summary
from sphero_probe.probing.introduction import SeenClient, introduce
from sphero_probe.probing.kept_findings import KeptFindings
from sphero_probe.probing.nodes import survey_notes
from sphero_probe.probing.notes import note_of, slow_note, tolerance_notes, unavailable_notes
from sphero_probe.probing.oneshot import heading_of
from sphero_probe.probing.pipeline import Pipeline
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.plans.loader import probes_of
from sphero_probe.probing.prober import FilledProbe, Prober
from sphero_probe.probing.progress import Progress, ProgressMeter
from sphero_probe.probing.recorder import NullRecorder, PreviousResults, Recorder
from sphero_probe.probing.results import Results
from sphero_probe.probing.retries import EXECUTED_BEFORE, SettledProbe, no_result
from sphero_probe.probing.scheduler import PROBES_PER_CHECK
from sphero_probe.probing.verifier import Verifier
from sphero_probe.protocol.packets import Malformed
from sphero_probe.session.reconnect import Reconnect, Reconnector

_KEPT_UNSOLICITED: Final = 256
"""Unsolicited packets that are kept to explain why a robot answers nothing."""
_BETWEEN_STAGES: Final = 0.5
"""Seconds from its first attempt on in which a probe may be answered, where the next stage depends on it."""


@dataclass(slots=True)
class Engine:
    """Runs one plan on one robot.

    Attributes:
        plan: what to send.
        link: to the robot.
        device: the robot's name or address, for the heading.
        target: the node for probes that name none; None sends no addresses.
        stop: set it to send nothing more and end once nothing is in flight.
        recorder: records every intent and record as it happens.
        announce: see ``Announce``; None if the recorder needs no waiting.
        earlier: what an interrupted run already settled.
        reconnect: connects to the same robot again; None never reconnects.
        line: how the robot is reached, for the heading: ``BLE`` or ``UART``.
        on_step: called with the name of each step of the introduction as it begins.
        total: probes of the stages that have begun.
    """

    plan: Plan
    link: Link
    device: str
    target: int | None = None
    stop: asyncio.Event = field(default_factory=asyncio.Event)
    recorder: Recorder = field(default_factory=NullRecorder)
    announce: Announce | None = None
    earlier: PreviousResults = field(default_factory=PreviousResults)
    reconnect: Reconnect | None = None
    line: str = ""
    on_step: Callable[[str], None] = lambda _: None
    total: int = 0
    _findings: KeptFindings = field(init=False)
    _prober: Prober = field(init=False)
    _line: Reconnector = field(init=False)
    _pipeline: Pipeline = field(init=False)
    _executions: Executions = field(init=False)
    _calibrator: Calibrator = field(init=False)
    _results: Results = field(init=False)
    _meter: ProgressMeter = field(init=False)
    _verifier: Verifier = field(init=False)
    _notes: list[Note] = field(default_factory=list)
    _unsolicited: list[Unsolicited] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._findings = KeptFindings(self.plan, self.link.codec)
        self._line = Reconnector(self.link, self.target, self.stop, self.reconnect)
        self._prober = Prober(self._line, self.target)
        self._prober.announce, self._prober.intend = self.announce, self.recorder.intend
        self._executions = Executions(self._prober, self._notes.append)
        self._pipeline = Pipeline(self._prober, self._line, self.stop, self._executions, self._notes.append)
        health = self._pipeline.health
        self._calibrator = Calibrator(self._prober, self._executions, health, verify=self.plan.verify)
        self._results = Results(self._prober, self.recorder, self._executions, self._findings)
        self._pipeline.on_answer = self._results.judge
        self._meter = ProgressMeter(self.plan, self._prober, self.earlier.findings)
        self._verifier = Verifier(
            self._prober, self._pipeline, self._results, self._meter, lambda: self._over
        )

    async def records(self) -> AsyncIterator[Record]:
        """Yield every record of the run, after the recorder has recorded it.

        Raises:
            NoAnswerError: the robot never answered anything.
            LinkLostError: the link was lost; raised after the summary.
            BadInputFileError: a stage of the plan is broken.
        """
        try:
            with describe_unsolicited(self.link, self._hear_unsolicited):
                async for record in self._records():
                    if not isinstance(record, Finding):  # findings are recorded as they are judged
                        self.recorder.record(record)
                    yield record
        finally:
            await self._pipeline.close()

    def progress(self) -> Progress:
        """Return how far the run is; it may be called at any time while it runs."""
        return self._meter.progress(asyncio.get_running_loop().time(), self._pipeline.silent.late_until)

    async def _records(self) -> AsyncIterator[Record]:
        """Yield a heading, then findings and notes as they are made, then a summary."""
        loop = asyncio.get_running_loop()
        began = loop.time()
        for index, stage in enumerate(self.plan.stages):
            if self._over:
                break
            probes = probes_of(self.plan, stage, self._findings.for_stage(index))
            self._findings.begin(index)
            if index == 0:
                for record in await self._introduction(probes):
                    yield record
            async for record in self._stage(probes, index):
                if isinstance(record, Finding):
                    self._findings.add(record)
                    self._meter.add(record)
                yield record
        if self.plan.verify and not self._over:
            changed = await self._verifier.send_again()
            for record in chain[Record](self._take_notes(), changed):
                yield record
        changed = await self._verifier.wait_for_late()
        for record in chain[Record](self._take_notes(), changed):
            yield record
        self._notes += tolerance_notes(self._line.link.tolerated)
        self._notes += unavailable_notes(self._findings, self.link.codec, self.link.policy.robot)
        for note in self._take_notes():
            yield note
        absent = self._findings.absent()
        for difference in comparisons(self.plan, self._findings, absent, self.link.codec):
            yield difference
        yield Summary(
            {word: self._findings.counts[word] for word in Outcome if self._findings.counts[word]},
            loop.time() - began,
            self._findings.sent,
            self._line.frames_sent,
            complete=not (
                self._over or self._results.is_incomplete or self._executions.commands or self._pipeline.dead
            ),
            strictness=self._calibrator.strictness,
        )
        if self._line.lost:
            raise self._line.lost

    @property
    def _over(self) -> bool:
        return self.stop.is_set() or self._line.lost is not None

    async def _introduction(self, probes: Sequence[Probe]) -> list[Record]:
        """Wake and identify the robot, and calibrate for the first stage; return the heading and notes."""
        for target in self.earlier.lenient:
            self.link.policy.length_checks.distrust(target)
        wanted = self._calibrator.find_wanted(probes, 1, self.earlier.findings)

        async def begin() -> None:
            self._results.firmware.update(
                await introduce(self._line, self.target, self.on_step, self._unsolicited)
            )
            self._line.expect_firmware(self._results.firmware)
            self._note_slowness()
            await self._calibrate(wanted)
            if not wanted.nodes and self.target not in self._pipeline.dead:
                await self._pipeline.health.passes(self.target)

        client = SeenClient()
        with exchanges_kept(self.link.events) as exchanges:
            with self.link.events.subscribe(client.hear, ExchangeEnded):
                await self._line.with_reconnect(begin)
            if self._over:
                return []
            notes = self._calibrator.notes(wanted)
            if self.plan.survey:
                notes += await survey_notes(self._line, self.target, self.device, self.line)
        heading = heading_of(self.plan, self.link, self.device, self.line)._replace(
            firmware=dict(self._results.firmware),
            strictness=self._calibrator.strictness,
            client=client.address,
        )
        return [heading, *notes, *exchange_notes(exchanges), *self._take_notes()]

    async def _calibrate(self, wanted: Wanted) -> None:
        self._pipeline.give_up_nodes(await self._calibrator.measure(wanted) - self._pipeline.dead)

    def _note_slowness(self) -> None:
        """Say so where every answer takes long: the run does, too."""
        pace = self.link.pace(self.target)
        if note := slow_note(pace.round_trip, pace.longest_timeout):
            self._notes.append(note)
            self.on_step(note.text)

    async def _stage(self, probes: Sequence[Probe], index: int) -> AsyncIterator[Record]:
        """Send the probes of one stage, then the silent ones again; yield their findings."""
        first = self.total + 1
        self.total += len(probes)
        self._pipeline.silent.loss.probes = self.total
        now = asyncio.get_running_loop().time
        if index:
            self._meter.calibrate(index, now())
            dead = self._pipeline.dead
            wanted = self._calibrator.find_wanted(probes, first, self.earlier.findings, dead)
            with exchanges_kept(self.link.events) as exchanges:
                await self._line.with_reconnect(lambda: self._calibrate(wanted))
            for note in (*self._calibrator.notes(wanted), *exchange_notes(exchanges)):
                yield note
        self._meter.begin(index, first, probes, now())
        chunk: list[PreparedProbe] = []
        last: list[FilledProbe] = []
        for number, probe in enumerate(probes, first):
            if self._over:
                break
            if settled := self._settled_earlier(number, probe):
                yield settled
                continue
            filled = self._calibrator.filled.pop(number, None) or self._prober.fill(number, probe)
            prepared = self._prober.prepare(filled)
            if prepared.is_wrong_length and not self._prober.has_evidence(filled.command):
                last.append(filled)
                continue
            chunk.append(prepared)
            if len(chunk) >= PROBES_PER_CHECK:
                for record in self._settle(await self._pipeline.feed(chunk)):
                    yield record
                chunk = []
        chunk += map(self._prober.prepare, last)
        patience = _BETWEEN_STAGES if index + 1 < len(self.plan.stages) else 0.0
        for record in self._settle(await self._pipeline.feed(chunk) + await self._pipeline.finish(patience)):
            yield record

    def _settle(self, settled: Sequence[SettledProbe]) -> list[Record]:
        """Return the notes so far and the findings of settled probes, in order."""
        ordered = sorted(settled, key=lambda settled_probe: settled_probe.probe.number)
        return [
            *self._take_notes(),
            *(settled_probe.finding or self._results.judge(settled_probe) for settled_probe in ordered),
        ]

    def _settled_earlier(self, number: int, probe: Probe) -> Finding | None:
        """Return the finding of this probe from an interrupted run, None if the probe must be sent."""
        finding = self.earlier.findings.get(number)
        if finding and finding.command[:2] == probe.command[:2]:
            return finding
        risk = self.earlier.doubtful.get(number, Risk.READ)
        if risk > Risk.PROBE:
            prepared = self._prober.prepare(self._prober.fill(number, probe))._replace(risk=risk)
            return self._results.judge(SettledProbe(prepared, no_result(prepared, 1), EXECUTED_BEFORE))
        return None

    def _hear_unsolicited(self, unsolicited: Unsolicited, described: dict[str, object]) -> None:
        """Record an unsolicited packet; a late answer still settles its own probe."""
        if len(self._unsolicited) < _KEPT_UNSOLICITED:
            self._unsolicited.append(unsolicited)
        if isinstance(unsolicited, LateResponse | Malformed):
            self._pipeline.silent.hear(unsolicited)
        self._results.readings.hear(unsolicited, now=asyncio.get_running_loop().time())
        self._notes.append(note_of(unsolicited, described))

    def _take_notes(self) -> list[Note]:
        taken, self._notes[:] = list(self._notes), []
        return taken
