"""A plan and a link in, records out: each probe that safety lets through is asked and yields one finding."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from sphero_probe import __version__
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown
from sphero_probe.errors import NoAnswerError
from sphero_probe.link.exchange import LateResponse, Silent, Unsolicited
from sphero_probe.link.link import Link
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.probing.comparison import compare
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.probing.judge import finding_of
from sphero_probe.probing.notes import calibration_note, node_name, note_of
from sphero_probe.probing.pipeline import Pipeline
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.plans.loader import probes_of
from sphero_probe.probing.prober import FilledProbe, Prober
from sphero_probe.probing.recorder import NullRecorder, PreviousResults, Recorder
from sphero_probe.probing.retries import EXECUTED_BEFORE, SettledProbe, no_result
from sphero_probe.probing.scheduler import PROBES_PER_CHECK
from sphero_probe.session.identify import ask_well_known, read_firmware, wake
from sphero_probe.session.reconnect import Reconnect, Reconnector

if TYPE_CHECKING:
    from sphero_probe.probing.attempt import PreparedProbe

_NO_ANSWER: Final = (
    "shake it, or put it on its charger and take it off; then look with: sphero-probe doctor --device …"
)


@dataclass(slots=True)
class Engine:
    """One plan asked of one robot.

    Attributes:
        plan: what to ask.
        link: whom.
        device: the robot's name or address, for the heading.
        target: the node for probes that name none; None leaves addresses out.
        stop: set it to send nothing more and end after what is in flight.
        recorder: told of every intent and record as it happens.
        earlier: what an interrupted run already settled.
        reconnect: opens a dropped link to the same robot again; None leaves it dropped.
        on_step: told the name of each step of calling on the robot as it begins.
        findings: so far, in the order they were settled.
        total: probes made known so far, for progress.
    """

    plan: Plan
    link: Link
    device: str
    target: int | None = None
    stop: asyncio.Event = field(default_factory=asyncio.Event)
    recorder: Recorder = field(default_factory=NullRecorder)
    earlier: PreviousResults = field(default_factory=PreviousResults)
    reconnect: Reconnect | None = None
    on_step: Callable[[str], None] = lambda _: None
    findings: list[Finding] = field(default_factory=list)
    total: int = 0
    _prober: Prober = field(init=False)
    _line: Reconnector = field(init=False)
    _pipeline: Pipeline = field(init=False)
    _notes: list[Note] = field(default_factory=list)
    _filled: dict[int, FilledProbe] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._line = Reconnector(self.link, self.target, self.stop, self.reconnect)
        self._prober = Prober(self._line, self.target)
        self._prober.intend = self.recorder.intend
        self._pipeline = Pipeline(self._prober, self._line, self.stop)
        self._pipeline.on_answer = self._judge

    async def records(self) -> AsyncIterator[Record]:
        """Yield every record of the run, each after the recorder has it.

        Raises:
            NoAnswerError: the robot never answered anything.
            LinkLostError: the robot is gone; a summary that says so came first.
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

    async def _records(self) -> AsyncIterator[Record]:
        """Yield a heading, then findings and notes as they come, then a summary."""
        loop = asyncio.get_running_loop()
        began = loop.time()
        for index, stage in enumerate(self.plan.stages):
            if self._over:
                break
            by_number = sorted(self.findings, key=lambda finding: finding.number)
            probes = probes_of(self.plan, stage, by_number)
            if index == 0:
                for record in await self._introduction(probes):
                    yield record
            async for record in self._stage(probes):
                if isinstance(record, Finding):
                    self.findings.append(record)
                yield record
        if self.plan.verify and not self._over:
            async for record in self._verify():
                yield record
        for note in self._take_notes():
            yield note
        if self.plan.verify and (difference := compare(self.findings, self.link.codec)):
            yield difference
        yield Summary(
            dict(Counter(finding.outcome for finding in self.findings)),
            loop.time() - began,
            sum(finding.attempts > 0 for finding in self.findings),
            self._line.frames_sent,
            complete=not self._over,
        )
        if self._line.lost:
            raise self._line.lost

    @property
    def _over(self) -> bool:
        return self.stop.is_set() or self._line.lost is not None

    async def _introduction(self, probes: Sequence[Probe]) -> list[Record]:
        """Wake and identify the robot, calibrate the nodes of the first stage; return what was seen."""
        robot = self.link.policy.robot
        nodes = self._nodes_to_calibrate(probes)
        firmware: dict[str, str] = {}

        async def introduce() -> None:
            self.on_step("wake")
            await wake(self._line.link, self.target)
            self.on_step("first answer")
            firmware.update(await read_firmware(self._line.link, self.target))
            if not self._line.link.answers:
                await ask_well_known(self._line.link, WellKnown.ECHO, self.target, attempts=1)
            if not self._line.link.answers:
                raise NoAnswerError("first answer: the robot is connected and answers nothing", _NO_ANSWER)
            self._line.expect_firmware(firmware)
            for target in nodes:
                if target not in self._prober.profiles:
                    await self._prober.calibrate(target)
            for target in nodes or [self.target]:
                await self._pipeline.health.passes(target)

        await self._line.with_reconnect(introduce)
        if self._over:
            return []
        profiles = self._prober.profiles
        heading = Heading(
            robot=robot.key if robot else "",
            model=robot.name if robot else "unknown model",
            device=self.device,
            firmware=firmware,
            plan=self.plan.name,
            tool_version=__version__,
            consent=self.link.policy.consent.words,
            strictness={
                node_name(target, robot): profile.strictness.value for target, profile in profiles.items()
            },
            started=datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z"),
        )
        notes = [calibration_note(profile, robot) for profile in profiles.values()]
        return [heading, *notes, *self._take_notes()]

    def _nodes_to_calibrate(self, probes: Sequence[Probe]) -> list[int | None]:
        """Return the nodes that have a probe whose harmlessness depends on their length checks.

        Of each node, probes are looked at until one needs that; what was filled in for it is kept.
        """
        nodes: list[int | None] = []
        for number, probe in enumerate(probes, 1):
            target = self.target if probe.command.target is None else probe.command.target
            if target in nodes or number in self.earlier.findings:
                continue
            self._filled[number] = self._prober.fill(number, probe)
            if self._prober.must_calibrate(self._filled[number]):
                nodes.append(target)
        return nodes

    async def _stage(self, probes: Sequence[Probe]) -> AsyncIterator[Record]:
        """Send the probes of one stage, then the silent ones again; yield their findings."""
        first = self.total + 1
        self.total += len(probes)
        self._pipeline.loss.probes = self.total
        chunk: list[PreparedProbe] = []
        for number, probe in enumerate(probes, first):
            if self._over:
                break
            if settled := self._settled_earlier(number, probe):
                yield settled
                continue
            filled = self._filled.pop(number, None) or self._prober.fill(number, probe)
            if self._prober.must_calibrate(filled):
                for record in self._settle(await self._pipeline.feed(chunk) + await self._pipeline.settle()):
                    yield record
                chunk = []
                notes = await self._calibrate(filled.command.target)
                if not notes:
                    break
                for note in notes:
                    yield note
            chunk.append(self._prober.prepare(filled))
            if len(chunk) >= PROBES_PER_CHECK:
                for record in self._settle(await self._pipeline.feed(chunk)):
                    yield record
                chunk = []
        for record in self._settle(await self._pipeline.feed(chunk) + await self._pipeline.finish()):
            yield record

    async def _calibrate(self, target: int | None) -> list[Note]:
        """Calibrate a node; nothing where the link is gone for good meanwhile."""

        async def calibrate() -> None:
            await self._prober.calibrate(target)

        await self._line.with_reconnect(calibrate)
        profile = self._prober.profiles.get(target)
        return [calibration_note(profile, self.link.policy.robot)] if profile else []

    async def _verify(self) -> AsyncIterator[Record]:
        """Send what exists or was silent, and one in twenty of the absent, again with one in flight.

        A probe that ends differently proves nothing: an inconclusive finding replaces its first one.
        """
        self._pipeline.limit_in_flight(1)
        self._pipeline.on_answer = self._finding  # recorded only where it differs
        before = {finding.number: finding for finding in self.findings if _is_verified(finding)}
        chunk: list[PreparedProbe] = []
        for number, finding in sorted(before.items()):
            prepared = self._prober.prepare(self._prober.fill(number, Probe(finding.command, exact=True)))
            if prepared.risk <= Risk.PROBE and not prepared.blocked:
                chunk.append(prepared)
        settled = await self._pipeline.feed(chunk)
        if not self._over:
            settled += await self._pipeline.finish()
        for note in self._take_notes():
            yield note
        for again in sorted(settled, key=lambda one: one.asked.number):
            new, old = again.finding or self._finding(again), before[again.asked.number]
            if not _agree(old, new):
                said = f"answered {_word(old)} first, then {_word(new)}"
                changed = old._replace(outcome=Outcome.INCONCLUSIVE, note=said)
                self.findings[self.findings.index(old)] = changed
                self.recorder.record(changed)
                yield changed

    def _settle(self, settled: Sequence[SettledProbe]) -> list[Record]:
        """Return the notes so far and the findings of settled probes, in order."""
        ordered = sorted(settled, key=lambda one: one.asked.number)
        return [*self._take_notes(), *(one.finding or self._judge(one) for one in ordered)]

    def _judge(self, settled: SettledProbe) -> Finding:
        """Judge a settled probe and have the recorder keep the finding."""
        finding = self._finding(settled)
        self.recorder.record(finding)
        return finding

    def _finding(self, settled: SettledProbe) -> Finding:
        """Return the finding of a settled probe; doubt makes it inconclusive."""
        probe, result, doubt, _ = settled
        masked = self._prober.masks(probe.command.target)
        finding = finding_of(probe, result, self.link.codec, masked=masked)
        return finding._replace(outcome=Outcome.INCONCLUSIVE, note=doubt) if doubt else finding

    def _settled_earlier(self, number: int, probe: Probe) -> Finding | None:
        """Return what an interrupted run found out about this very probe, None where it is to be sent."""
        finding = self.earlier.findings.get(number)
        if finding and finding.command[:2] == probe.command[:2]:
            return finding
        risk = self.earlier.doubtful.get(number, Risk.READ)
        if risk > Risk.PROBE:
            prepared = self._prober.prepare(self._prober.fill(number, probe))._replace(risk=risk)
            return self._judge(SettledProbe(prepared, no_result(prepared, 1), EXECUTED_BEFORE))
        return None

    def _hear_unsolicited(self, unsolicited: Unsolicited, described: dict[str, object]) -> None:
        """Keep what else was heard; a late answer still settles its own probe."""
        if isinstance(unsolicited, LateResponse) and isinstance(unsolicited.earlier, Silent):
            self._pipeline.hear(unsolicited)
        self._notes.append(note_of(unsolicited, described))

    def _take_notes(self) -> list[Note]:
        taken, self._notes = self._notes, []
        return taken


def _is_verified(finding: Finding) -> bool:
    """Whether a verifying run asks this one again: what exists or was silent, one in twenty of the rest."""
    if finding.outcome is Outcome.ABSENT:
        return finding.number % 20 == 0
    return finding.outcome in (Outcome.EXISTS, Outcome.SILENT)


def _agree(old: Finding, new: Finding) -> bool:
    """Whether two findings of one probe say the same; a value may have changed meanwhile, its code not."""
    return (old.outcome, old.code_name) == (new.outcome, new.code_name)


def _word(finding: Finding) -> str:
    return finding.code_name or finding.outcome.value
