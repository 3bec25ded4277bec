"""Models of links and robots, and how long a sweep of them takes on a virtual clock."""

import asyncio
import math
from collections.abc import Coroutine, Sequence
from random import Random
from time import process_time
from typing import Any, Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered, Blocked
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.wrong_lengths import WRONG_PAYLOAD
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Heading, Outcome
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.session.addressing import usual_target
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.simulator.command_queue import SERVICE
from sphero_probe.simulator.radio import BITS_PER_BYTE
from sphero_probe.simulator.settings import Line, Timing
from sphero_probe.transports.fake import FakeTransport
from sphero_probe.transports.fake_address import CLIENT_PORTS
from sphero_probe.virtual_clock import VirtualClock

ONE_DEVICE: Final = (0x13,)
_PACKET: Final = 20
"""Bytes per packet of the modelled link."""
_NODE: Final = 0x11
_PEER_PAUSE: Final = 0.075
_PEER_PATIENCE: Final = 10.0
"""Seconds that spherov2 0.12.1 waits between writes to a BOLT, and for an answer."""


class Cell(NamedTuple):
    """One modelled link and robot.

    Attributes:
        interval: seconds between connection events; 0 for no events.
        per_event: packets per event in each direction.
        silent: fraction of the commands that are never answered.
        queue: commands that can wait in the robot.
        loss: fraction of the packets that are lost, in each direction.
        service: seconds that the robot takes for one command.
        baud: bits per second of a UART; None for Bluetooth.
        is_measured: answers take as long as those of a real robot did.
    """

    interval: float
    per_event: int
    silent: float
    queue: int
    loss: float
    service: float = SERVICE
    baud: int | None = None
    is_measured: bool = False

    def __str__(self) -> str:
        """Return the text for a table."""
        link = f"{self.interval * 1000:.0f} ms x {self.per_event}"
        if self.baud:
            link = f"UART at {self.baud} baud"
        if self.is_measured:
            link = "measured round trips of a Mini"
        slow = f", {self.service * 1000:.0f} ms per command" if self.service != SERVICE else ""
        return f"{link}, {self.silent:.0%} silent, queue {self.queue}, {self.loss:.0%} lost{slow}"

    @property
    def per_command(self) -> float:
        """The least seconds per command that the robot's queue allows: what overflows it is lost.

        All commands of a connection event arrive at once. One is served, the others wait.
        """
        return max(self.service, self.interval / (self.queue + 1))


class Swept(NamedTuple):
    """The result of a sweep.

    Attributes:
        seconds: from the first probe to the last finding.
        calling: seconds before that, for identification and calibration.
        limit: the least seconds that the link needs to carry every probe once.
        false: commands that are reported as silent but do answer.
        simulating: seconds of this machine's time that the simulated robot took.
    """

    seconds: float
    calling: float
    limit: float
    false: int
    simulating: float


class _TimedRobot(FakeRobot):
    """A simulated robot that measures what it costs.

    Attributes:
        seconds: of this machine's time.
    """

    seconds = 0.0

    def hear(self, data: bytes, *, now: float) -> None:
        """Take what the host wrote."""
        began = process_time()
        super().hear(data, now=now)
        self.seconds += process_time() - began

    def speak(self, *, now: float) -> list[bytes]:
        """Return what has arrived at the host."""
        began = process_time()
        said = super().speak(now=now)
        self.seconds += process_time() - began
        return said

    def next_time(self) -> float | None:
        """Return when there may be more."""
        began = process_time()
        due = super().next_time()
        self.seconds += process_time() - began
        return due


def sweep_of(cell: Cell, dids: Sequence[int], seed: int) -> Swept:
    """Sweep these devices of a modelled BOLT+ with the engine, as ``sphero-probe sweep`` does."""
    robot = _robot(cell, dids, seed)
    findings: dict[int, Finding] = {}
    times: list[float] = []

    async def work() -> None:
        last = 0.0
        now = asyncio.get_running_loop().time
        robot.connect(now=now())
        transport = FakeTransport(robot)
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, Consent(), (robot.name,))
        plan = Plan("sweep", "", [list(sweep(dids, range(256)))])
        target = usual_target(robot.model, CLIENT_PORTS[Line.UART if cell.baud else Line.BLE])
        async with Link(transport, codec, policy) as link:
            run = Engine(plan, link, robot.name, target)
            times.append(now())
            async for record in run.records():
                if isinstance(record, Heading):
                    times.append(now())
                elif isinstance(record, Finding):
                    last = now()
                    findings[record.number] = record
            times.append(last)
        transport.close()

    _run(work())
    began, called, ended = times
    asked = [finding for finding in findings.values() if finding.outcome is not Outcome.SKIPPED]
    limit = limit_of(cell, asked)
    if ended - called < limit:
        raise AssertionError(f"faster than its link: {cell}, seed {seed}")
    silent = silences_of(cell, dids, seed)
    false = [
        finding
        for finding in asked
        if finding.outcome is Outcome.SILENT and finding.command[:2] not in silent
    ]
    return Swept(ended - called, called - began, limit, len(false), robot.seconds)


def limit_of(cell: Cell, findings: Sequence[Finding]) -> float:
    """Return the seconds that a link needs to carry each command and each response once."""
    exchanges = [finding.exchange for finding in findings]
    up = sum(math.ceil(len(one.sent) / _PACKET) for one in exchanges if not isinstance(one, Blocked))
    down = sum(math.ceil(len(one.received) / _PACKET) for one in exchanges if isinstance(one, Answered))
    sent = sum(not isinstance(one, Blocked) for one in exchanges)
    least = max(up, down) / cell.per_event * cell.interval
    if cell.baud:
        there = sum(len(one.sent) for one in exchanges if not isinstance(one, Blocked))
        back = sum(len(one.received) for one in exchanges if isinstance(one, Answered))
        least = max(there, back) * BITS_PER_BYTE / cell.baud
    return max(least, sent * cell.per_command)


def strategy_of_spherov2(cell: Cell, seed: int) -> float:
    """Return the seconds to send 256 CIDs one at a time, with a pause, and a timeout of ten seconds."""
    robot = _robot(cell, ONE_DEVICE, seed)
    codec = CODECS[robot.model.generation]
    policy = Policy(codec.generation, robot.model, Consent(frozenset(Risk), robot.name), (robot.name,))
    took: list[float] = []

    async def work() -> None:
        loop = asyncio.get_running_loop()
        robot.connect(now=loop.time())
        transport = FakeTransport(robot)
        async with Link(transport, codec, policy, timeout=_PEER_PATIENCE, window=1) as link:
            for cid in range(256):
                await link.ask(Command(*ONE_DEVICE, cid, WRONG_PAYLOAD, _NODE), alone=True)
                await asyncio.sleep(_PEER_PAUSE)
            took.append(loop.time())
        transport.close()

    _run(work())
    return took[0]


def _run(work: Coroutine[Any, Any, None]) -> None:
    with asyncio.Runner(loop_factory=VirtualClock) as runner:
        runner.run(work)


def _robot(cell: Cell, dids: Sequence[int], seed: int) -> _TimedRobot:
    is_radio = bool(cell.interval)
    settings = parse_settings("rvr" if cell.baud else "bolt-plus")._replace(
        interval=cell.interval if is_radio else None,
        per_event=cell.per_event if is_radio else None,
        queue=cell.queue,
        service=cell.service,
        baud=cell.baud,
        line=Line.UART if cell.baud else Line.BLE,
        timing=Timing.MEASURED if cell.is_measured else Timing.FIXED,
        loss=cell.loss,
        seed=seed,
        silent=silences_of(cell, dids, seed),
    )
    return _TimedRobot(settings)


def silences_of(cell: Cell, dids: Sequence[int], seed: int) -> frozenset[tuple[int, int]]:
    """Return the pairs that a modelled robot never answers; it always answers identification."""
    chance = Random(f"{seed} silent")
    rows = (row_for(Generation.V2, job) for job in (WellKnown.WAKE, WellKnown.ECHO, WellKnown.VERSION))
    calling = {(row.did, row.cid) for row in rows if row}
    pairs = ((did, cid) for did in dids for cid in range(256))
    return frozenset(pair for pair in pairs if chance.random() < cell.silent and pair not in calling)
