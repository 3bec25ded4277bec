"""Compares the time of a sweep with the least time that its link needs, on modelled links.

Everything runs on a virtual clock, so the times are those of the modelled link, the same on every machine.
"""

import asyncio
import math
from collections.abc import Coroutine, Iterator, Sequence
from random import Random
from statistics import median
from typing import Any, Final, NamedTuple

from benchmarks.section import Line, Options, Ratio, Remark, Section
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered, Blocked
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.wrong_lengths import WRONG_LENGTH
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Heading, Outcome
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.fake import FakeTransport
from sphero_probe.virtual_clock import VirtualClock

LINKS: Final = ((0.015, 6), (0.030, 4), (0.050, 4))
"""Seconds between connection events, packets per event in each direction."""
SILENT: Final = (0.0, 0.05, 0.2)
QUEUES: Final = (8, 2)
LOSSES: Final = (0.0, 0.02)
USUAL: Final = (0.05, 8)
"""Fraction of silent commands and length of the robot's queue that the targets are for."""
_SEEDS: Final = 20
_QUICK_SEEDS: Final = 3
_PACKET: Final = 20
"""Bytes per packet of the modelled link."""
_NODE: Final = 0x11
_ONE_DEVICE: Final = (0x13,)
MOST_ONE, MOST_ALL, _BAR_PEER = 1.6, 1.3, 30.0
_PEER_PAUSE: Final = 0.075
_PEER_PATIENCE: Final = 10.0
"""Seconds that spherov2 0.12.1 waits between writes to a BOLT, and for an answer."""


class Cell(NamedTuple):
    """One modelled link and robot.

    Attributes:
        interval: seconds between connection events.
        per_event: packets per event in each direction.
        silent: fraction of the commands that are never answered.
        queue: commands that can wait in the robot.
        loss: fraction of the packets that are lost, in each direction.
    """

    interval: float
    per_event: int
    silent: float
    queue: int
    loss: float

    def __str__(self) -> str:
        """Return the text for a table."""
        link = f"{self.interval * 1000:.0f} ms x {self.per_event}"
        return f"{link}, {self.silent:.0%} silent, queue {self.queue}, {self.loss:.0%} lost"


class Swept(NamedTuple):
    """The result of a sweep.

    Attributes:
        seconds: from the first probe to the last finding.
        calling: seconds before that, for identification and calibration.
        limit: the least seconds that the link needs to carry every probe once.
        false: commands that are reported as silent but do answer.
    """

    seconds: float
    calling: float
    limit: float
    false: int


def measure(options: Options) -> Iterator[Line | Remark]:
    """Sweep modelled robots, also with the strategy of spherov2."""
    seeds = _QUICK_SEEDS if options.quick else _SEEDS
    yield Remark("simulated: links, robots and the clock; the brackets show the extremes over all seeds")
    yield Remark("compared with the link's limit: our time divided by the least time for every probe once,")
    yield Remark("from the first probe to the last finding, without identification and calibration")
    for interval, per_event in LINKS:
        for silent in SILENT:
            for queue in QUEUES:
                for loss in LOSSES:
                    cell = Cell(interval, per_event, silent, queue, loss)
                    swept = [sweep_of(cell, _ONE_DEVICE, seed) for seed in range(seeds)]
                    bar = MOST_ONE if (silent, queue) == USUAL and not loss else None
                    yield _line("256 CIDs", cell, swept, bar)
    dids = range(0x40, 0x50) if options.quick else range(256)
    for interval, per_event in LINKS:
        for loss in LOSSES:
            cell = Cell(interval, per_event, *USUAL, loss)
            bar = None if loss else MOST_ALL
            yield _line(f"{len(dids)} x 256", cell, [sweep_of(cell, dids, 0)], bar)
    for interval, per_event in LINKS:
        cell = Cell(interval, per_event, *USUAL, 0.0)
        theirs = [strategy_of_spherov2(cell, seed) for seed in range(seeds)]
        ours = [sweep_of(cell, _ONE_DEVICE, seed) for seed in range(seeds)]
        quotients = sorted(their / our.seconds for their, our in zip(theirs, ours, strict=True))
        ratio = Ratio(median(quotients), quotients[0], quotients[-1])
        whole = median(their / (our.calling + our.seconds) for their, our in zip(theirs, ours, strict=True))
        note = f"{median(theirs):.0f} s; {whole:.0f}x with our identification and calibration"
        yield Line(f"256 CIDs: {cell}", "spherov2's strategy", ratio, _BAR_PEER, note=note)


def _line(what: str, cell: Cell, swept: Sequence[Swept], ceiling: float | None) -> Line:
    over = sorted(one.seconds / one.limit for one in swept)
    ratio = Ratio(median(over), over[0], over[-1])
    false = sum(one.false for one in swept)
    calling = median(one.calling for one in swept)
    note = f"{calling:.2f} s of identification and calibration; {false} false silences"
    return Line(f"{what}: {cell}", "the link's limit", ratio, note=note, ceiling=ceiling)


def sweep_of(cell: Cell, dids: Sequence[int], seed: int) -> Swept:
    """Sweep these devices of a modelled BOLT+ with the engine, as ``sphero-probe sweep`` does."""
    robot = _robot(cell, dids, seed)
    findings: list[Finding] = []
    times: list[float] = []

    async def work() -> None:
        last = 0.0
        now = asyncio.get_running_loop().time
        robot.connect(now=now())
        transport = FakeTransport(robot)
        codec = CODECS[robot.model.generation]
        policy = Policy(codec.generation, robot.model, Consent(), (robot.name,))
        async with Link(transport, codec, policy) as link:
            run = Engine(Plan("sweep", "", [list(sweep(dids, range(256)))]), link, robot.name, _NODE)
            times.append(now())
            async for record in run.records():
                if isinstance(record, Heading):
                    times.append(now())
                elif isinstance(record, Finding):
                    last = now()
            times.append(last)
            findings.extend(run.findings)
        transport.close()

    _run(work())
    began, called, ended = times
    asked = [finding for finding in findings if finding.outcome is not Outcome.SKIPPED]
    limit = limit_of(cell, asked)
    if ended - called < limit:
        raise AssertionError(f"faster than its link: {cell}, seed {seed}")
    silent = silences_of(cell, dids, seed)
    false = [
        finding
        for finding in asked
        if finding.outcome is Outcome.SILENT and finding.command[:2] not in silent
    ]
    return Swept(ended - called, called - began, limit, len(false))


def limit_of(cell: Cell, findings: Sequence[Finding]) -> float:
    """Return the seconds that a link needs to carry each command and each response once."""
    exchanges = [finding.exchange for finding in findings]
    up = sum(math.ceil(len(one.sent) / _PACKET) for one in exchanges if not isinstance(one, Blocked))
    down = sum(math.ceil(len(one.received) / _PACKET) for one in exchanges if isinstance(one, Answered))
    return max(up, down) / cell.per_event * cell.interval


def strategy_of_spherov2(cell: Cell, seed: int) -> float:
    """Return the seconds to send 256 CIDs one at a time, with a pause, and a timeout of ten seconds."""
    robot = _robot(cell, _ONE_DEVICE, seed)
    codec = CODECS[robot.model.generation]
    policy = Policy(codec.generation, robot.model, Consent(frozenset(Risk), robot.name), (robot.name,))
    took: list[float] = []

    async def work() -> None:
        loop = asyncio.get_running_loop()
        robot.connect(now=loop.time())
        transport = FakeTransport(robot)
        async with Link(transport, codec, policy, timeout=_PEER_PATIENCE, window=1) as link:
            for cid in range(256):
                await link.ask(Command(*_ONE_DEVICE, cid, bytes(WRONG_LENGTH), _NODE), alone=True)
                await asyncio.sleep(_PEER_PAUSE)
            took.append(loop.time())
        transport.close()

    _run(work())
    return took[0]


def _run(work: Coroutine[Any, Any, None]) -> None:
    with asyncio.Runner(loop_factory=VirtualClock) as runner:
        runner.run(work)


def _robot(cell: Cell, dids: Sequence[int], seed: int) -> FakeRobot:
    settings = parse_settings("bolt-plus")._replace(
        interval=cell.interval,
        per_event=cell.per_event,
        queue=cell.queue,
        loss=cell.loss,
        seed=seed,
        silent=silences_of(cell, dids, seed),
    )
    return FakeRobot(settings)


def silences_of(cell: Cell, dids: Sequence[int], seed: int) -> frozenset[tuple[int, int]]:
    """Return the pairs that a modelled robot never answers; it always answers identification."""
    chance = Random(f"{seed} silent")
    rows = (row_for(Generation.V2, job) for job in (WellKnown.WAKE, WellKnown.ECHO, WellKnown.VERSION))
    calling = {(row.did, row.cid) for row in rows if row}
    pairs = ((did, cid) for did in dids for cid in range(256))
    return frozenset(pair for pair in pairs if chance.random() < cell.silent and pair not in calling)


SECTION = Section("sweep", "the time of a sweep compared with its link's limit, on a virtual clock", measure)
