"""Compare the findings with the robot's own list of commands and with the catalogue."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Finding, Note, Outcome
from sphero_probe.probing.plan import Plan
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Response, Verdict

_Device = tuple[int | None, int]
"""Node, DID."""
_Triple = tuple[int | None, int, int]
"""Node, DID, CID."""


class Claims(NamedTuple):
    """The devices and commands that a robot lists as its own.

    Attributes:
        nodes: nodes that listed their devices.
        devices: the devices they listed.
        listed: devices that listed their commands.
        commands: the commands they listed.
    """

    nodes: set[int | None]
    devices: set[_Device]
    listed: set[_Device]
    commands: set[_Triple]


class AbsentCommands:
    """The absent commands and devices of a run: one bit for each command."""

    def __init__(self, codec: Codec) -> None:
        """Set the codec whose codes the answers carry."""
        self._codec = codec
        self._commands: defaultdict[_Device, int] = defaultdict(int)
        self._verdicts: defaultdict[_Device, set[Verdict]] = defaultdict(set)

    def __contains__(self, triple: _Triple) -> bool:
        """Whether a probe of this command ended as absent."""
        target, did, cid = triple
        return bool(self._commands.get((target, did), 0) >> cid & 1)

    @property
    def devices(self) -> set[_Device]:
        """The devices that answered every probe with 'no such device'."""
        return {device for device, said in self._verdicts.items() if said == {Verdict.NO_DEVICE}}

    def learn(self, finding: Finding) -> None:
        """Take in one finding of the run, of any outcome."""
        target, did, cid = _triple(finding)
        if finding.outcome is Outcome.ABSENT:
            self._commands[target, did] |= 1 << cid
        if isinstance(finding.exchange, Answered):
            self._verdicts[target, did].add(self._codec.verdict(finding.exchange.response.code))


def comparisons(
    plan: Plan, findings: Iterable[Finding], absent: AbsentCommands, codec: Codec
) -> Iterator[Note]:
    """Yield what a finished plan compares: its claims, and if it verifies, the robot's own list.

    Args:
        plan: that was run.
        findings: of the run; those of absent and of skipped commands may be missing in a plan that verifies.
        absent: all absent commands of the run, for a plan that verifies.
        codec: whose codes the answers carry.
    """
    if plan.claimed_by and (note := _claimed_absent(plan.claimed_by, findings)):
        yield note
    if plan.verify and (note := compare(list(findings), absent, codec)):
        yield note


def _claimed_absent(source: str, findings: Iterable[Finding]) -> Note | None:
    """Return what a source claims and the robot does not have, None if it has everything."""
    absent = dict.fromkeys(_triple(one) for one in findings if one.outcome is Outcome.ABSENT)
    if not absent:
        return None
    text = f"claimed by {source}, absent on this firmware: {_listed(absent)}"
    return Note("comparison", text, {"claimed_by": source, "claimed_absent": _as_json(absent)})


def compare(findings: Sequence[Finding], absent: AbsentCommands, codec: Codec) -> Note | None:
    """Return the differences: hidden (not listed), ghost (listed but absent), unknown (in no catalogue).

    A node that listed its devices claims to have no others. A listed device that is absent is a ghost, and so
    are all commands that it listed.

    Args:
        findings: of a run; those of absent and of skipped commands may be missing.
        absent: all absent commands of the run.
        codec: whose codes the answers carry.

    Returns:
        A note, None if nothing differs.
    """
    claims = claims_of(findings, codec)
    exists = [finding for finding in findings if finding.outcome is Outcome.EXISTS]
    gone = absent.devices
    hidden = dict.fromkeys(triple for triple in map(_triple, exists) if _is_hidden(triple, claims))
    ghosts = sorted((triple for triple in claims.commands if triple in absent or triple[:2] in gone), key=str)
    unknown = dict.fromkeys(_triple(finding) for finding in exists if finding.knowledge is None)
    ghost_devices = sorted(claims.devices & gone, key=str)
    if not (hidden or ghosts or unknown or ghost_devices):
        return None
    parts = (
        ("hidden", _listed(hidden)),
        ("ghost", _listed(ghosts)),
        ("ghost devices", ", ".join(dict.fromkeys(f"0x{did:02x}" for _, did in ghost_devices))),
        ("unknown but exists", _listed(unknown)),
    )
    text = "; ".join(f"{word}: {listed}" for word, listed in parts if listed)
    data: dict[str, object] = {
        "hidden": _as_json(hidden),
        "ghost": _as_json(ghosts),
        "unknown": _as_json(unknown),
        "ghost_devices": [{"target": target, "did": did} for target, did in ghost_devices],
    }
    return Note("comparison", text, data)


def claimed_devices(findings: Iterable[Finding], codec: Codec) -> list[_Device]:
    """Return the devices that nodes listed, each once."""
    row = row_for(codec.generation, WellKnown.CLAIMED_DEVICES)
    pair = (row.did, row.cid) if row else None
    found = (
        (finding.command.target, did)
        for finding, response in _successes(findings, codec)
        if finding.command[:2] == pair
        for did in response.payload
    )
    return list(dict.fromkeys(found))


def _is_hidden(triple: _Triple, claims: Claims) -> bool:
    target, did, _ = triple
    if (target, did) in claims.listed:
        return triple not in claims.commands
    return target in claims.nodes and (target, did) not in claims.devices


def claims_of(findings: Sequence[Finding], codec: Codec) -> Claims:
    """Return the devices and commands that the robot listed in the answers of a run."""
    devices = row_for(codec.generation, WellKnown.CLAIMED_DEVICES)
    commands = row_for(codec.generation, WellKnown.CLAIMED_COMMANDS)
    claims = Claims(set(), set(claimed_devices(findings, codec)), set(), set())
    for finding, response in _successes(findings, codec):
        target, payload = finding.command.target, finding.command.payload
        if devices and finding.command[:2] == (devices.did, devices.cid):
            claims.nodes.add(target)
        elif commands and finding.command[:2] == (commands.did, commands.cid) and len(payload) == 1:
            claims.listed.add((target, payload[0]))
            claims.commands.update((target, payload[0], cid) for cid in response.payload)
    return claims


def _successes(findings: Iterable[Finding], codec: Codec) -> Iterator[tuple[Finding, Response]]:
    for finding in findings:
        exchange = finding.exchange
        if isinstance(exchange, Answered) and codec.verdict(exchange.response.code) is Verdict.OK:
            yield finding, exchange.response


def _triple(finding: Finding) -> _Triple:
    command = finding.command
    return command.target, command.did, command.cid


def _listed(triples: Iterable[_Triple]) -> str:
    return ", ".join(dict.fromkeys(f"0x{did:02x}:0x{cid:02x}" for _, did, cid in triples))


def _as_json(triples: Iterable[_Triple]) -> list[dict[str, int | None]]:
    return [{"target": target, "did": did, "cid": cid} for target, did, cid in triples]
