"""Runs a sweep or a discovery on a stranger, on the virtual clock and with a time limit."""

import asyncio
from collections.abc import Iterable, Iterator
from contextlib import AsyncExitStack, aclosing
from dataclasses import dataclass, field
from typing import Any, Final

from sphero_probe.catalogue import ROBOTS
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Note, Record
from sphero_probe.probing.plan import Plan, Probe, Stage, sweep
from sphero_probe.probing.plans.discovery import discovery
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation
from tests.support.strangers.habits import Stranger
from tests.support.strangers.robot import Robot
from tests.support.strangers.transport import StrangerTransport
from tests.support.virtual_clock import run as run_on_virtual_clock

LONGEST: Final = 600.0
"""Seconds on the virtual clock that a run may take."""
KINDS: Final = ("sweep", "discovery")
CIDS: Final = range(0x40)
_FEW_CIDS: Final = range(0x10, 0x20)
_MORE_CIDS: Final = frozenset({*range(0xF0, 0x100), 0x8D, 0xAB, 0xD8})
"""Where a discovery asks for what cannot exist, and the ids that must be escaped."""
ABSENT_DEVICES: Final = (0x14, 0x2C)
"""Devices that no stranger has."""

Triple = tuple[int, int, int]


@dataclass
class Ran:
    """One run on one stranger.

    Attributes:
        kind: ``sweep`` or ``discovery``.
        stranger: the stranger.
        robot: its state afterwards, with its truth and its ledger.
        records: the records of the run.
        error: the error that it raised.
        seconds: how long it took, on the virtual clock.
        on_the_way: commands that may be on their way to the robot while an answer comes back: none on the
            virtual clock, where an answer is known when it is sent; over the air as many as are in flight.
    """

    kind: str
    stranger: Stranger
    robot: Robot
    records: list[Record] = field(default_factory=list)
    error: BaseException | None = None
    seconds: float = 0.0
    on_the_way: int = 0

    @property
    def findings(self) -> list[Finding]:
        """The last finding about each probe."""
        last = {record.number: record for record in self.records if isinstance(record, Finding)}
        return list(last.values())

    @property
    def comparison(self) -> dict[str, list[Triple]]:
        for record in self.records:
            if isinstance(record, Note) and record.kind == "comparison":
                return {word: _triples(record.data.get(word)) for word in ("hidden", "ghost", "unknown")}
        return {"hidden": [], "ghost": [], "unknown": []}


def run(stranger: Stranger, kind: str, *, stop_at: float | None = None) -> Ran:
    """Sweep a stranger, or discover it, on the virtual clock, within bounds.

    Args:
        stranger: on whom.
        kind: ``sweep`` or ``discovery``.
        stop_at: seconds after which the run is told to end, None to let it go on.
    """
    robot = Robot(stranger.firmware, stranger.voice)
    ran = Ran(kind, stranger, robot)
    generation = Generation.V1 if stranger.firmware.older else Generation.V2
    codec = CODECS[generation]
    policy = Policy(generation, ROBOTS[stranger.model], Consent(), ("Stranger",))
    target = None if stranger.firmware.older else 0x11
    cids = cids_of(stranger)

    async def work() -> None:
        loop = asyncio.get_running_loop()
        pipes: list[StrangerTransport] = []
        async with AsyncExitStack() as line:

            async def connect() -> Link:
                await line.aclose()
                pipes.append(StrangerTransport(robot, pipes[-1].writes if pipes else 0))
                line.callback(pipes[-1].close)
                return await line.enter_async_context(Link(pipes[-1], codec, policy))

            plan = _plan(stranger, kind, generation, target, cids)
            engine = Engine(plan, await connect(), "Stranger", target, reconnect=connect)
            if stop_at is not None:
                loop.call_at(stop_at, engine.stop.set)
            try:
                async with asyncio.timeout(LONGEST), aclosing(engine.records()) as records:  # type: ignore[type-var]
                    async for record in records:
                        ran.records.append(record)
            except Exception as error:  # noqa: BLE001 - which ones may come is what is judged
                ran.error = error
            ran.seconds = loop.time()

    try:
        run_on_virtual_clock(work())
    except (AssertionError, RuntimeError) as error:  # tasks left behind, or a wait without end
        ran.error = ran.error or error
    return ran


def cids_of(stranger: Stranger) -> range:
    return _FEW_CIDS if stranger.few else CIDS


def _plan(stranger: Stranger, kind: str, generation: Generation, target: int | None, cids: range) -> Plan:
    dids = sorted({row.did for row in stranger.firmware.rows} | set(ABSENT_DEVICES))
    if kind == "sweep":
        return Plan("sweep", "", [list(_sweeps(stranger, target, cids))], verify=True)
    if stranger.few:
        dids = [did for did in dids if did in (0x10, 0x13, *ABSENT_DEVICES)]
    plan = discovery(generation, target, dids=dids)
    return Plan(plan.name, "", [_narrowed(stage, cids) for stage in plan.stages], verify=True)


def _sweeps(stranger: Stranger, target: int | None, cids: range) -> Iterator[Probe]:
    if target is None:
        yield from sweep((0x00, 0x02, *ABSENT_DEVICES), cids)
        return
    devices = {(row.node, row.did) for row in stranger.firmware.rows if row.did not in (0x10, 0x19)}
    if stranger.few:
        devices = {(node, did) for node, did in devices if did in (0x13, 0x18)}
    yield from sweep(ABSENT_DEVICES, cids)
    for node, did in sorted(devices):
        yield from sweep([did], cids, target & 0xF0 | node)


def _narrowed(stage: Stage, cids: range) -> Stage:
    """Reduce a stage to the commands that are worth the time."""

    def fewer(findings: Any) -> Iterable[Probe]:
        for probe in stage(findings) if callable(stage) else stage:
            did, cid = probe.command.did, probe.command.cid
            if cid in cids or cid in _MORE_CIDS or (did in (0x10, 0x11) and cid < cids.start):
                yield probe

    return fewer


def _triples(listed: Any) -> list[Triple]:
    return [((pair["target"] or 1) & 0x0F, pair["did"], pair.get("cid", 0)) for pair in listed or ()]


def triple_of(finding: Finding) -> Triple:
    command = finding.command
    return (1 if command.target is None else command.target & 0x0F), command.did, command.cid
