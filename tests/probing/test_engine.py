"""The engine on a virtual clock against fake robots: every finding is true or says inconclusive."""

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import pytest

from sphero_probe.catalogue.model import Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError, LinkLostError, NoAnswerError
from sphero_probe.link.exchange import Answered
from sphero_probe.link.link import Link
from sphero_probe.link.pacing import WIDEST
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.wrong_lengths import is_impossible
from sphero_probe.probing.calibration import Calibration
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.probing.oneshot import send_once, stop_motors
from sphero_probe.probing.plan import Plan, Probe, Stage, sweep
from sphero_probe.probing.profiles import NodeProfile, Strictness
from sphero_probe.probing.retries import LossEstimate
from sphero_probe.probing.scheduler import PROBES_PER_CHECK
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Response, Role
from sphero_probe.session.reconnect import Reconnector
from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from tests.support.virtual_clock import run as run_on_virtual_clock

if TYPE_CHECKING:
    from sphero_probe.transports.base import Transport

DEFAULT = Consent()
PRIMARY, SECONDARY = 0x11, 0x12


class Asking(NamedTuple):
    """What a run on a fake robot left behind."""

    records: list[Record]
    executed: list[Executed]
    robot: FakeRobot
    lost: LinkLostError | None

    @property
    def findings(self) -> dict[tuple[int, int], Finding]:
        found = [record for record in self.records if isinstance(record, Finding)]
        return {finding.command[:2]: finding for finding in sorted(found)}

    @property
    def heading(self) -> Heading:
        return next(record for record in self.records if isinstance(record, Heading))

    @property
    def summary(self) -> Summary:
        return next(record for record in self.records if isinstance(record, Summary))

    def notes(self, kind: str) -> list[Note]:
        return [record for record in self.records if isinstance(record, Note) and record.kind == kind]


class Unplugged:
    """A transport that is gone after so many writes."""

    def __init__(self, inner: FakeTransport, writes: int) -> None:
        self._inner = inner
        self._left = writes

    async def write(self, data: bytes) -> None:
        self._left -= 1
        if self._left < 0:
            self._inner.close()
            raise LinkLostError("unplugged")
        await self._inner.write(data)

    async def read(self) -> bytes:
        return await self._inner.read()


def ask(
    settings: str,
    stages: Sequence[Stage],
    *,
    consent: Consent = DEFAULT,
    unplug_after: int | None = None,
    stop_after: int | None = None,
) -> Asking:
    executed: list[Executed] = []
    robot = FakeRobot(parse_settings(settings), on_execute=executed.append)
    records: list[Record] = []
    lost: list[LinkLostError] = []

    async def work() -> None:
        pipe = FakeTransport(robot)
        transport: Transport = pipe if unplug_after is None else Unplugged(pipe, unplug_after)
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, consent, (robot.name,))
        async with Link(transport, codec, policy) as link:
            target = PRIMARY if robot.model.addressed else None
            run = Engine(Plan("test", "", stages), link, robot.name, target)
            try:
                async for record in run.records():
                    records.append(record)
                    findings = sum(isinstance(one, Finding) for one in records)
                    if stop_after is not None and findings >= stop_after:
                        run.stop.set()
            except LinkLostError as error:
                lost.append(error)

    run_on_virtual_clock(work())
    return Asking(records, executed, robot, lost[0] if lost else None)


def whole(did: int, target: int | None = None) -> list[Probe]:
    return list(sweep([did], range(256), target))


def truth_of(outcome: Asking, node: int) -> set[tuple[int, int]]:
    return {(fact.did, fact.cid) for fact in outcome.robot.truth() if fact.node == node}


@pytest.mark.parametrize("model", ["bolt", "bolt-plus", "mini", "rvr", "r2d2", "r2q5", "bb9e", "lmq"])
def test_every_finding_of_a_whole_device_is_true(model: str) -> None:
    outcome = ask(f"{model}?hidden=6&seed=4", [whole(0x13)])
    truth = truth_of(outcome, 1)
    assert len(outcome.findings) == 256
    for pair, finding in outcome.findings.items():
        if finding.outcome is Outcome.SKIPPED:
            assert finding.attempts == 0
            assert finding.risk > Risk.PROBE
            assert "--allow" in finding.note
        else:
            assert finding.outcome is (Outcome.EXISTS if pair in truth else Outcome.ABSENT), finding
            assert finding.confidence is Confidence.CERTAIN
    assert {command.risk for command in outcome.executed} == {Risk.READ}
    assert list(outcome.heading.strictness.values()) == [Strictness.STRICT]
    assert outcome.summary.complete
    assert sum(outcome.summary.counts.values()) == 256


@pytest.mark.parametrize(
    "faults",
    [
        "loss=0.05",
        "loss=0.03&duplicate=0.1",
        "corrupt=0.03",
        "busy=0.1",
        "split=1&latency=40ms",
        "latency=990ms",
    ],
)
@pytest.mark.unmeasured
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_bad_radio_never_makes_a_wrong_word(faults: str, seed: int) -> None:
    outcome = ask(f"bolt?{faults}&hidden=4&seed={seed}", [whole(0x13)])
    truth = truth_of(outcome, 1)
    assert len(outcome.findings) == 256
    for pair, finding in outcome.findings.items():
        if finding.outcome is Outcome.EXISTS:
            assert pair in truth
        elif finding.outcome is Outcome.ABSENT:
            assert pair not in truth
        else:
            assert finding.outcome in (Outcome.SKIPPED, Outcome.SILENT, Outcome.INCONCLUSIVE)
    unknown = [f for f in outcome.findings.values() if f.outcome in (Outcome.SILENT, Outcome.INCONCLUSIVE)]
    assert len(unknown) <= 4
    assert {command.risk for command in outcome.executed} == {Risk.READ}


def test_a_late_answer_still_settles_its_own_probe() -> None:
    outcome = ask("bolt?latency=1300ms", [[Probe(Command(0x13, 0x03)), Probe(Command(0x13, 0x17))]])
    assert {finding.outcome for finding in outcome.findings.values()} == {Outcome.EXISTS}
    assert outcome.notes("late")


class SlowOn(FakeTransport):
    """A pipe to a robot that takes half a second for some commands, and answers others meanwhile."""

    def __init__(self, robot: FakeRobot, pairs: set[tuple[int, int]]) -> None:
        super().__init__(robot)
        self._pairs = pairs
        self._coming: asyncio.Queue[bytes] = asyncio.Queue()
        self._decoder = CODECS[robot.model.generation].decoder(Role.HOST)
        self._pump: asyncio.Task[None] | None = None

    async def read(self) -> bytes:
        self._pump = self._pump or asyncio.create_task(self._carry())
        return await self._coming.get()

    async def _carry(self) -> None:
        loop, codec = asyncio.get_running_loop(), CODECS[self.robot.model.generation]
        while data := await super().read():
            for packet in self._decoder.feed(data):
                slow = isinstance(packet, Response) and (packet.did, packet.cid) in self._pairs
                loop.call_later(0.5 if slow else 0.02, self._coming.put_nowait, codec.frame_of(packet))
        self._coming.put_nowait(b"")


def test_late_answers_are_waited_for_at_the_end_as_well() -> None:
    slow = [(0x13, 0x03), (0x13, 0x17)]
    robot = FakeRobot(parse_settings("bolt"))
    found: dict[tuple[int, ...], Outcome] = {}

    async def work() -> None:
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, DEFAULT, (robot.name,))
        pipe = SlowOn(robot, set(slow))
        async with Link(pipe, codec, policy) as link:
            others = [Probe(Command(0x13, cid)) for cid in range(0x40, 0x80)]
            plan = Plan("test", "", [[Probe(Command(*slow[0])), *others, Probe(Command(*slow[1]))]])
            engine = Engine(plan, link, robot.name, PRIMARY)
            found.update(
                [(one.command[:2], one.outcome) async for one in engine.records() if isinstance(one, Finding)]
            )
        pipe.close()
        if pipe._pump:
            await pipe._pump

    run_on_virtual_clock(work())
    assert [found[pair] for pair in slow] == [Outcome.EXISTS, Outcome.EXISTS]


def test_a_silent_probe_is_sent_three_times() -> None:
    outcome = ask("bolt?silent=0x13:0x03", [[Probe(Command(0x13, 0x03)), Probe(Command(0x13, 0x17))]])
    silent = outcome.findings[0x13, 0x03]
    assert (silent.outcome, silent.attempts) == (Outcome.SILENT, 3)
    assert outcome.findings[0x13, 0x17].outcome is Outcome.EXISTS


@pytest.mark.parametrize(
    ("settings", "strictness"),
    [
        ("bolt", Strictness.STRICT),
        ("bolt?mask=1", Strictness.MASKING),
        ("bolt?strict=minimum", Strictness.LENIENT),
        ("bolt?strict=none", Strictness.LENIENT),
        ("mini?mask=1", Strictness.MASKING),
        ("rvr?busy=0.3", Strictness.STRICT),
    ],
)
def test_strictness_is_measured(settings: str, strictness: Strictness) -> None:
    outcome = ask(settings, [[Probe(Command(0x13, 0x70))]])
    assert list(outcome.heading.strictness.values()) == [strictness]
    assert len(outcome.notes("calibration")) == 1
    assert {command.risk for command in outcome.executed} == {Risk.READ}


def test_the_summary_has_the_nodes_that_a_later_stage_measured() -> None:
    outcome = ask("bolt", [[Probe(Command(0x13, 0x70))], [Probe(Command(0x13, 0x70, b"", SECONDARY))]])
    assert outcome.heading.strictness == {"primary": Strictness.STRICT}
    assert outcome.summary.strictness == {"primary": Strictness.STRICT, "secondary": Strictness.STRICT}


def test_a_missing_node_is_reported() -> None:
    outcome = ask("bolt-plus", [whole(0x1A, SECONDARY)])
    assert outcome.heading.strictness == {"node 0x12": Strictness.NO_NODE}
    asked = [f for f in outcome.findings.values() if f.outcome is not Outcome.SKIPPED]
    assert {finding.outcome for finding in asked} == {Outcome.ABSENT}
    assert {finding.note for finding in asked} == {"no such node"}


def test_a_masking_robot_proves_nothing_by_a_rejected_length() -> None:
    outcome = ask("bolt?mask=1", [whole(0x13)])
    lengths = [f for f in outcome.findings.values() if f.code_name == "bad data length"]
    assert lengths
    assert {finding.outcome for finding in lengths} == {Outcome.INCONCLUSIVE}
    documented = {f.note for f in lengths if f.knowledge and f.knowledge.kind is Kind.COMMAND}
    assert documented == {"documented, not confirmed: commands that cannot exist get the same answer"}
    assert outcome.findings[0x13, 0x03].outcome is Outcome.EXISTS


@pytest.mark.parametrize("strict", ["minimum", "none"])
@pytest.mark.parametrize("did", [0x13, 0x1A])
def test_a_lenient_robot_gets_no_wrong_lengths(strict: str, did: int) -> None:
    outcome = ask(f"bolt?strict={strict}&hidden=9", [whole(did)])
    assert {command.risk for command in outcome.executed} == {Risk.READ}
    sent = [finding for finding in outcome.findings.values() if finding.attempts]
    assert {finding.risk for finding in sent if not is_impossible(finding.command)} == {Risk.READ}


def test_a_robot_that_sleeps_is_woken_first() -> None:
    executed: list[Executed] = []
    robot = FakeRobot(parse_settings("r2d2"), on_execute=executed.append)
    robot.hear(CODECS[robot.model.generation].encode_command(Command(0x13, 0x01), 0), now=0.0)
    assert robot.asleep

    async def work() -> Finding:
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, DEFAULT, ())
        async with Link(FakeTransport(robot), codec, policy) as link:
            return await send_once(link, Command(0x13, 0x03))

    finding = run_on_virtual_clock(work())
    assert finding.outcome is Outcome.EXISTS
    assert finding.attempts == 2


def test_a_stage_is_made_from_the_findings_of_the_one_before() -> None:
    def follow(findings: Sequence[Finding]) -> list[Probe]:
        assert [finding.outcome for finding in findings] == [Outcome.EXISTS]
        return [Probe(Command(0x13, 0x17))]

    outcome = ask("bolt", [[Probe(Command(0x13, 0x03))], follow])
    assert [record.number for record in outcome.records if isinstance(record, Finding)] == [1, 2]


def test_a_stage_that_breaks_names_the_plan() -> None:
    def broken(findings: Sequence[Finding]) -> list[Probe]:
        raise ValueError(findings)

    with pytest.raises(BadInputFileError, match="ValueError"):
        ask("bolt", [[Probe(Command(0x13, 0x03))], broken])


def test_exact_payloads_are_sent_unchanged() -> None:
    outcome = ask("bolt", [[Probe(Command(0x10, 0x00, b"hi")), Probe(Command(0x13, 0x70), exact=True)]])
    echo = outcome.findings[0x10, 0x00].exchange
    assert isinstance(echo, Answered)
    assert echo.response.payload == b"hi"
    assert outcome.findings[0x13, 0x70].outcome is Outcome.SKIPPED


def test_consent_lets_documented_writes_run_properly() -> None:
    consent = Consent(frozenset({Risk.READ, Risk.PROBE, Risk.WRITE}))
    outcome = ask("bolt", [[Probe(Command(0x1A, 0x4E))]], consent=consent)
    assert outcome.findings[0x1A, 0x4E].code_name == "success"
    assert [command.risk for command in outcome.executed if command.did == 0x1A] == [Risk.WRITE]


@pytest.mark.parametrize("writes", [0, 1, 5, 20, 40, 100])
def test_a_lost_link_keeps_what_was_found_and_calls_the_rest_nothing(writes: int) -> None:
    outcome = ask("bolt", [whole(0x13)], unplug_after=writes)
    assert outcome.lost is not None
    assert not outcome.summary.complete
    truth = truth_of(outcome, 1)
    for pair, finding in outcome.findings.items():
        if finding.outcome is Outcome.EXISTS:
            assert pair in truth
        elif finding.outcome is Outcome.INCONCLUSIVE:
            assert finding.note == "the link was lost before this was settled"
        else:
            assert finding.outcome in (Outcome.ABSENT, Outcome.SKIPPED)


def test_stopping_sends_nothing_more_and_says_so() -> None:
    outcome = ask("bolt?latency=20ms", [whole(0x13)], stop_after=10)
    assert not outcome.summary.complete
    assert 10 <= len(outcome.findings) <= 10 + PROBES_PER_CHECK + WIDEST
    assert outcome.lost is None


def test_a_robot_that_answers_nothing_is_reported() -> None:
    with pytest.raises(NoAnswerError, match=r"first answer: .* answers nothing"):
        ask("bolt?loss=1", [whole(0x13)])


def test_stopping_during_the_introduction_does_not_wait_for_the_robot() -> None:
    robot = FakeRobot(parse_settings("bolt?loss=1"))
    times = []

    async def work() -> None:
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, DEFAULT, (robot.name,))
        async with Link(FakeTransport(robot), codec, policy) as link:
            run = Engine(Plan("test", "", [whole(0x13)]), link, robot.name, PRIMARY)
            loop = asyncio.get_running_loop()
            loop.call_later(0.5, run.stop.set)
            (summary,) = [record async for record in run.records()]
            times.append(loop.time())
            assert isinstance(summary, Summary)
            assert not summary.complete

    run_on_virtual_clock(work())
    assert times == [pytest.approx(0.5)]


def test_stopped_before_a_silent_probe_was_repeated_is_inconclusive() -> None:
    probes = [Probe(Command(0x13, 0x03)), *whole(0x13)[16:40]]
    outcome = ask("bolt?silent=0x13:0x03&latency=20ms", [probes], stop_after=1)
    silent = outcome.findings[0x13, 0x03]
    assert silent.outcome is Outcome.INCONCLUSIVE
    assert silent.note == "stopped before this was sent again"


def test_what_may_have_been_executed_is_not_repeated() -> None:
    consent = Consent(frozenset({Risk.READ, Risk.PROBE, Risk.MOTION}))
    outcome = ask(
        "bolt?silent=0x16:0x01", [[Probe(Command(0x16, 0x01, bytes(4), SECONDARY))]], consent=consent
    )
    finding = outcome.findings[0x16, 0x01]
    assert (finding.outcome, finding.attempts) == (Outcome.INCONCLUSIVE, 1)
    assert len([command for command in outcome.executed if command.did == 0x16]) == 1


def test_motors_are_stopped_where_motion_was_allowed() -> None:
    robot_executed: list[Executed] = []
    robot = FakeRobot(parse_settings("rvr"), on_execute=robot_executed.append)

    async def work(consent: Consent) -> None:
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, consent, ())
        async with Link(FakeTransport(robot), codec, policy) as link:
            await stop_motors(link, PRIMARY)

    run_on_virtual_clock(work(DEFAULT))
    assert robot_executed == []
    run_on_virtual_clock(work(Consent(frozenset({Risk.MOTION}))))
    assert [(command.node, command.did, command.cid) for command in robot_executed] == [(2, 0x16, 0x01)]
    assert set(robot_executed[0].payload) == {0}


async def nothing_more() -> None:
    pass


def test_calibration_shows_its_evidence() -> None:
    robot = FakeRobot(parse_settings("bolt-plus"))

    async def work() -> NodeProfile:
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, DEFAULT, ())
        async with Link(FakeTransport(robot), codec, policy) as link:
            calibration = Calibration(Reconnector(link, PRIMARY), PRIMARY, LossEstimate())
            assert await calibration.measure(nothing_more)
            await calibration.ask_setter()
            await calibration.finish()
            return calibration.profile()

    profile = run_on_virtual_clock(work())
    assert [(step.wanted, step.said) for step in profile.steps] == [
        ("success", "success"),
        ("success", "success"),
        ("success", "success"),
        ("no such command id", "bad command id"),
        ("no such device id", "bad device id"),
        ("bad data length", "bad data length"),
        ("bad data length", "bad data length"),
        ("bad data length", "bad data length"),
        ("bad data length", "bad data length"),
        *[("absent", "bad device id"), ("absent", "bad command id")] * 2,
    ]
