"""The full map of a robot as a plan: a generation and a person's wishes in, stages out.

Identify, ask the robot what it has, find its nodes, close the device ids that are not there, ask every
command of those that are; by request also which lengths and values a command takes. Calibration and verifying
are the engine's.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final

from sphero_probe.catalogue import BRICK_DEVICES, PERSIST_DEVICES, all_rows, row_by_name
from sphero_probe.catalogue.model import Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import FACTS, WellKnown, row_for
from sphero_probe.link.exchange import Answered
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS
from sphero_probe.probing.comparison import claimed_devices
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.probing.plan import Plan, Probe, Stage
from sphero_probe.probing.system import NODES
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command, Generation, Verdict

LENGTHS: Final = (1, 2, 4, 16, 8, 3, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20, 0)
"""Payload lengths to try, likely ones first [commands_v2]; 0 comes last, as it executes the most."""
VALUES: Final = (1, 2, 4, 8, 16, 32, 64, 128, 255)

_Findings = Sequence[Finding]


def discovery(
    generation: Generation,
    target: int | None,
    *,
    dids: Iterable[int] = range(256),
    lengths: bool = False,
    values: bool = False,
) -> Plan:
    """Return the plan that maps a whole robot.

    Args:
        generation: its protocol.
        target: address byte of its usual node; None where addresses are left out, and then for no other node.
        dids: the device ids to look at.
        lengths: also find out which lengths a command takes, where consent covers executing it.
        values: also try values, where one was refused.
    """
    map_ = _Map(generation, target, tuple(dids))
    named: list[tuple[str, Stage]] = [
        ("identity", map_.facts()),
        ("own list", map_.claimed_devices()),
        ("own list", map_.claimed_commands),
        ("nodes", map_.nodes()),
        *(("devices", map_.devices(cid)) for cid in IMPOSSIBLE_CIDS),
        ("commands", map_.commands),
    ]
    if lengths:
        named += [("lengths", map_.of_length(length)) for length in LENGTHS]
    if values:
        named += [("values", map_.of_value(value)) for value in VALUES]
    names, stages = zip(*named, strict=True)
    summary = "the full map of a robot"
    return Plan("discover", summary, stages, verify=True, survey=True, stage_names=names)


def claims(generation: Generation, target: int | None) -> Plan:
    """Return the plan that asks a robot only for its own list: of each node the devices, and their commands.

    Args:
        generation: its protocol.
        target: address byte of its usual node; None where addresses are left out, and then for no other node.
    """
    map_ = _Map(generation, target, ())
    named: list[tuple[str, Stage]] = [
        ("devices", map_.claimed_devices()),
        ("nodes", map_.nodes()),
        ("devices", map_.claimed_devices_of_others),
        ("commands", map_.claimed_commands),
    ]
    names, stages = zip(*named, strict=True)
    return Plan("claims", "what a robot says it has", stages, stage_names=names)


class _Map:
    """Makes the stages; what was found so far comes in with each."""

    def __init__(self, generation: Generation, target: int | None, dids: tuple[int, ...]) -> None:
        self._generation = generation
        self._codec = CODECS[generation]
        self._target = target
        self._dids = dids

    def facts(self) -> list[Probe]:
        """Stage 0: who is it."""
        rows = (row_by_name(self._generation, name) for name in FACTS[self._generation])
        return [Probe(Command(row.did, row.cid, b"", self._target)) for row in rows if row]

    def claimed_devices(self) -> list[Probe]:
        """Stage 1: which devices does it say it has."""
        row = row_for(self._generation, WellKnown.CLAIMED_DEVICES)
        return [Probe(Command(row.did, row.cid, b"", self._target))] if row else []

    def claimed_commands(self, findings: _Findings) -> Iterator[Probe]:
        """Stage 1, continued: which commands does it say each of them has."""
        commands = row_for(self._generation, WellKnown.CLAIMED_COMMANDS)
        asked = {finding.command for finding in findings}
        for target, did in claimed_devices(findings, self._codec) if commands else ():
            probe = Command(commands.did, commands.cid, bytes([did]), target) if commands else None
            if probe and probe not in asked:
                yield Probe(probe)

    def claimed_devices_of_others(self, findings: _Findings) -> Iterator[Probe]:
        """Stage 2, continued: the same question for every other node that was found."""
        row = row_for(self._generation, WellKnown.CLAIMED_DEVICES)
        for target in self._nodes(findings):
            if row and target != self._target:
                yield Probe(Command(row.did, row.cid, b"", target))

    def nodes(self) -> list[Probe]:
        """Stage 2: which nodes answer an echo."""
        echo = row_for(self._generation, WellKnown.ECHO)
        if self._target is None or echo is None:
            return []
        usual = Address.from_byte(self._target)
        return [
            Probe(Command(echo.did, echo.cid, b"", usual.with_node(node).byte))
            for node in NODES
            if node != usual.node
        ]

    def devices(self, cid: int) -> Callable[[_Findings], Iterator[Probe]]:
        """Stage 4: which devices are there; what one command id calls absent is confirmed with two more."""

        def stage(findings: _Findings) -> Iterator[Probe]:
            first = cid == IMPOSSIBLE_CIDS[0]
            yield from self.claimed_devices_of_others(findings) if first else self.claimed_commands(findings)
            closed = self._closed(findings)
            for target in self._nodes(findings):
                for did in self._dids:
                    if first or (target, did) in closed:
                        yield Probe(Command(did, self._harmless(did, cid), b"", target))

        return stage

    def commands(self, findings: _Findings) -> Iterator[Probe]:
        """Stage 5: every command of the devices that are there."""
        closed = self._closed(findings)
        seen = {finding.command._replace(payload=b"") for finding in findings}
        for target in self._nodes(findings):
            for did in self._dids:
                if (target, did) in closed:
                    continue
                for cid in range(256):
                    if Command(did, cid, b"", target) not in seen:
                        yield Probe(Command(did, cid, b"", target))

    def of_length(self, length: int) -> Callable[[_Findings], Iterator[Probe]]:
        """Stage 6: does a command of unknown arguments take this length."""

        def stage(findings: _Findings) -> Iterator[Probe]:
            refused: dict[Command, bool] = {}
            for finding in findings:
                known = finding.knowledge
                if finding.outcome is Outcome.EXISTS and not (known and known.request):
                    bare = finding.command._replace(payload=b"")
                    verdict = self._verdict(finding)
                    refused[bare] = refused.get(bare, True) and verdict is Verdict.BAD_LENGTH
            for command, still in refused.items():
                if still:
                    yield Probe(command._replace(payload=bytes(length)), exact=True)

        return stage

    def of_value(self, value: int) -> Callable[[_Findings], Iterator[Probe]]:
        """Stage 7: is another first byte taken where a value was refused."""

        def stage(findings: _Findings) -> Iterator[Probe]:
            for finding in findings:
                payload = finding.command.payload
                if self._verdict(finding) is Verdict.BAD_VALUE and payload and not any(payload):
                    changed = bytes([value]) + payload[1:]
                    yield Probe(finding.command._replace(payload=changed), exact=True)

        return stage

    def _harmless(self, did: int, cid: int) -> int:
        """What to ask of a device: the absent id; of a dangerous one a documented read, nothing else goes."""
        if did in BRICK_DEVICES[self._generation] | PERSIST_DEVICES[self._generation]:
            for row in all_rows(self._generation):
                if row.did == did and row.risk is Risk.READ and row.kind is Kind.COMMAND:
                    return row.cid
        return cid

    def _nodes(self, findings: _Findings) -> list[int | None]:
        echo = row_for(self._generation, WellKnown.ECHO)
        nodes: dict[int | None, None] = {self._target: None}
        for finding in findings:
            if echo and finding.command[:2] == (echo.did, echo.cid) and finding.outcome is Outcome.EXISTS:
                nodes[finding.command.target] = None
        return list(nodes)

    def _closed(self, findings: _Findings) -> set[tuple[int | None, int]]:
        """Node and DID of the devices that every answer so far called absent."""
        closed: set[tuple[int | None, int]] = set()
        open_: set[tuple[int | None, int]] = set()
        for finding in findings:
            pair = finding.command.target, finding.command.did
            (closed if self._verdict(finding) is Verdict.NO_DEVICE else open_).add(pair)
        return closed - open_

    def _verdict(self, finding: Finding) -> Verdict | None:
        exchange = finding.exchange
        return self._codec.verdict(exchange.response.code) if isinstance(exchange, Answered) else None
