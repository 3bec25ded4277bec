"""Run the evidence plan on a robot and collect every answer. The main class is ``Collecting``."""

import asyncio
from collections import Counter
from collections.abc import Callable, Coroutine
from contextlib import ExitStack
from typing import Any, Final, NamedTuple

from sphero_probe import __version__
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.errors import LinkLostError
from sphero_probe.link.events import BytesReceived, ExchangeEnded, UnsolicitedReceived
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent, Unsolicited
from sphero_probe.link.pacing import FIRST_TIMEOUT
from sphero_probe.link.wrong_lengths import is_impossible
from sphero_probe.probing.bursts import send_burst
from sphero_probe.probing.calibrator import Calibrator, Wanted
from sphero_probe.probing.evidence import (
    WINDOWS,
    Asked,
    Burst,
    Ending,
    Evidence,
    Heard,
    Idle,
    MeasuredNode,
    Topic,
)
from sphero_probe.probing.executions import Executions
from sphero_probe.probing.introduction import introduce
from sphero_probe.probing.plan import Probe
from sphero_probe.probing.plans.evidence import ERROR_CODES, burst_of, evidence_probes, evidence_targets
from sphero_probe.probing.prober import BUSY_PAUSE, Prober
from sphero_probe.protocol.packets import USUAL, Command, Notification, Request, Role, Verdict
from sphero_probe.session.identify import ask_well_known, wake
from sphero_probe.session.reconnect import Reconnector
from sphero_probe.session.session import Session

MOST_ASKED: Final = 1000
MOST_CHUNKS: Final = 64
MOST_HEARD: Final = 32
_ATTEMPTS: Final = 3
"""How often a silent or busy command is asked."""
_RUNS: Final = 2
"""How often a part of the run is begun: a command that drops the link is sent twice at most."""
_UNSOLICITED: Final = 256


class CollectingOptions(NamedTuple):
    """How to collect evidence.

    Attributes:
        line: the kind of line, for the document.
        idle: seconds in which nothing is sent at the end, 0 for none.
        on_topic: called with each part of the run as it begins.
    """

    line: str
    idle: float = 0.0
    on_topic: Callable[[Topic], None] = lambda _: None


class Collecting:
    """One evidence run on one robot, over drops of the link.

    Every command passes the policy of the link. What calibration measures holds for the rest of the run:
    on a node that executes wrong lengths, only documented reads are sent.
    """

    def __init__(self, session: Session, stop: asyncio.Event, options: CollectingOptions) -> None:
        self._session = session
        self._options = options
        self._line = Reconnector(session.link, session.target, stop, session.reconnect)
        self._prober = Prober(self._line, session.target)
        self._executions = Executions(self._prober, lambda _: None)
        self._codec = session.link.codec
        self._topic = Topic.CALIBRATION
        self._complete = True
        self._firmware: dict[str, str] = {}
        self._asked: list[Asked] = []
        self._answered: set[Command] = set()
        self._chunks: Counter[int] = Counter()
        self._unsolicited: list[Unsolicited] = []
        self._bursts: list[Burst] = []
        self._heard: list[Heard] = []
        self._quiet_since: float | None = None
        self._idle: Idle | None = None

    async def run(self) -> Evidence:
        """Ask everything; an interrupted run returns what it has.

        Raises:
            NoAnswerError: the robot answers nothing.
        """
        session, robot = self._session, self._session.connection.robot
        events = session.link.events
        loop = asyncio.get_running_loop()
        began = loop.time()
        with ExitStack() as listening:
            listening.enter_context(events.subscribe(self._on_exchange, ExchangeEnded))
            listening.enter_context(events.subscribe(self._on_bytes, BytesReceived))
            listening.enter_context(events.subscribe(self._on_unsolicited, UnsolicitedReceived))
            await self._part(Topic.CALIBRATION, self._calibrate)
            probes = evidence_probes(self._codec.generation, robot, session.target, session.connection.port)
            await self._part(Topic.ORDER, lambda: self._ask_each(probes[Topic.ORDER]))
            await self._part(Topic.LISTS, lambda: self._ask_each(probes[Topic.LISTS]))
            await self._part(Topic.CODES, lambda: self._ask_codes(probes[Topic.CODES]))
            await self._part(Topic.NODES, lambda: self._ask_each(probes[Topic.NODES]))
            await self._part(Topic.SIZES, lambda: self._find_size(probes[Topic.SIZES]))
            await self._part(Topic.BURSTS, self._send_bursts)
            if self._options.idle:
                await self._part(Topic.IDLE, self._wait)
        return Evidence(
            tool_version=__version__,
            robot=robot.key if robot else "",
            generation=self._codec.generation,
            line=self._options.line,
            firmware=dict(self._firmware),
            write_size=session.connection.write_size,
            chunks=dict(sorted(self._chunks.items())),
            nodes=tuple(
                MeasuredNode(profile.target, profile.strictness.value, profile.why)
                for profile in self._prober.profiles.values()
            ),
            asked=tuple(self._asked),
            bursts=tuple(self._bursts),
            idle=self._idle,
            surprises=tuple(self._executions.commands),
            complete=self._complete and not (self._line.lost or self._line.is_stopped),
            frames_sent=self._line.frames_sent,
            seconds=loop.time() - began,
        )

    async def _part(self, topic: Topic, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run one part; after a drop it begins once more, and what was answered is not asked again."""
        runs = 0

        async def begin() -> None:
            nonlocal runs
            runs += 1
            if runs > _RUNS:
                self._complete = False
                return
            await work()

        self._topic = topic
        if not (self._line.lost or self._line.is_stopped):
            self._options.on_topic(topic)
        await self._line.with_reconnect(begin)

    async def _calibrate(self) -> None:
        """Wake and identify the robot, and measure how strictly each node checks lengths."""
        session = self._session
        self._firmware = await introduce(self._line, session.target, session.on_step, self._unsolicited)
        self._line.expect_firmware(self._firmware)
        echo = row_for(self._codec.generation, WellKnown.ECHO)
        dids = [echo.did] if echo else []
        targets = evidence_targets(session.connection.robot, session.target)
        calibrator = Calibrator(self._prober, self._executions, verify=False)
        await calibrator.measure(Wanted(dict.fromkeys(targets, dids), ()))

    async def _ask_each(self, probes: list[Probe]) -> None:
        for probe in probes:
            await self._ask(probe.command)

    async def _ask(self, command: Command, wanted: int | None = None) -> Exchange | None:
        """Ask until it is answered, a few times at most; None if it was answered, or its node is mute.

        Args:
            command: to send.
            wanted: the code that it asks for, which may be that of a busy robot.
        """
        profile = self._prober.profiles.get(command.target)
        if command in self._answered or (profile and profile.is_mute):
            return None
        if is_impossible(command) and not self._line.link.policy.length_checks.is_absent(command):
            self._keep(Blocked(command, Risk.PROBE, "calibration did not find that it is absent"))
            return None
        exchange: Exchange | None = None
        for attempt in range(_ATTEMPTS):
            exchange = await self._line.link.ask(command, alone=attempt > 0)
            if isinstance(exchange, Blocked):
                break
            if isinstance(exchange, Answered):
                if self._verdict(exchange) is not Verdict.BUSY or exchange.response.code == wanted:
                    break
                await self._line.pause(BUSY_PAUSE)
        return exchange

    async def _ask_codes(self, probes: list[Probe]) -> None:
        """Ask for each code; a node that does not return the first one is not asked for the others."""
        lacking: set[Command] = set()
        for probe in probes:
            code, form = probe.command.payload[0], probe.command._replace(payload=b"")
            if form in lacking:
                continue
            exchange = await self._ask(probe.command, code)
            if exchange is None or code != ERROR_CODES[0]:
                continue
            if not (isinstance(exchange, Answered) and exchange.response.code == code):
                lacking.add(form)

    async def _find_size(self, probes: list[Probe]) -> None:
        """Send echoes that grow until one does not come back."""
        for probe in probes:
            exchange = await self._ask(probe.command)
            if exchange and not (
                isinstance(exchange, Answered) and exchange.response.payload == probe.command.payload
            ):
                return

    async def _send_bursts(self) -> None:
        """Send echoes at once; a burst that loses some is sent once more, and the better result counts."""
        for count in WINDOWS[len(self._bursts) :]:
            best = await self._burst(count)
            if best.answered < count:
                await self._line.pause(FIRST_TIMEOUT)
                best = max(best, await self._burst(count), key=lambda burst: burst.answered)
            self._bursts.append(best)

    async def _burst(self, count: int) -> Burst:
        commands = burst_of(self._codec.generation, self._session.target, count)
        return await send_burst(self._line.link, list(commands))

    async def _wait(self) -> None:
        """Send nothing for a time and hear what comes; then see whether the robot still answers."""
        if self._idle:
            return
        loop = asyncio.get_running_loop()
        self._quiet_since = since = loop.time()
        waiting = asyncio.create_task(self._line.link.closed())
        dropped = False
        try:
            await asyncio.wait({waiting}, timeout=self._options.idle)
            dropped = waiting.done()
        finally:
            self._quiet_since = None
            self._idle = Idle(round(loop.time() - since, 1), tuple(self._heard), dropped, awake=None)
            waiting.cancel()
            await asyncio.gather(waiting, return_exceptions=True)
        if dropped:
            raise LinkLostError("the robot closed the connection while nothing was sent")
        echo = await ask_well_known(self._line.link, WellKnown.ECHO, self._session.target)
        self._idle = self._idle._replace(awake=isinstance(echo, Answered))
        await wake(self._line.link, self._session.target, 1)

    def _verdict(self, exchange: Answered) -> Verdict:
        return self._codec.verdict(exchange.response.code)

    def _on_exchange(self, event: ExchangeEnded) -> None:
        exchange = event.exchange
        if isinstance(exchange, Answered):
            self._answered.add(exchange.command)
        self._keep(exchange)

    def _keep(self, exchange: Exchange) -> None:
        if self._topic is not Topic.BURSTS and len(self._asked) < MOST_ASKED:
            self._asked.append(self._as_asked(exchange))

    def _as_asked(self, exchange: Exchange) -> Asked:
        command = exchange.command._replace(options=USUAL)
        match exchange:
            case Blocked():
                return Asked(self._topic, command, None, Ending.BLOCKED)
            case Silent():
                return Asked(self._topic, command, self._flags(exchange.sent), Ending.SILENT)
            case Answered(response=response):
                return Asked(
                    self._topic,
                    command,
                    self._flags(exchange.sent),
                    Ending.ANSWERED,
                    response.code,
                    response.payload,
                    response.source,
                    response.target,
                    round(exchange.rtt * 1000, 1),
                )

    def _flags(self, frame: bytes) -> int:
        (request,) = self._codec.decoder(Role.ROBOT).feed(frame)
        return request.flags if isinstance(request, Request) else 0

    def _on_bytes(self, event: BytesReceived) -> None:
        size = len(event.data)
        if size in self._chunks or len(self._chunks) < MOST_CHUNKS:
            self._chunks[size] += 1

    def _on_unsolicited(self, event: UnsolicitedReceived) -> None:
        packet = event.unsolicited
        if len(self._unsolicited) < _UNSOLICITED:
            self._unsolicited.append(packet)
        since = self._quiet_since
        if since is not None and isinstance(packet, Notification) and len(self._heard) < MOST_HEARD:
            self._heard.append(Heard(packet.did, packet.cid, round(event.time - since, 1)))
