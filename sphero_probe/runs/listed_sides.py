"""Make the sides of a comparison that are lists: of the catalogue, a built-in robot's firmware, or a robot.

Such a side says which commands exist, and that all others of its nodes are absent. It has no answers.
"""

from collections.abc import Iterable, Sequence
from typing import Final

from sphero_probe.catalogue import commands_of, lookup
from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.errors import UsageError
from sphero_probe.probing.comparison import claims_of
from sphero_probe.probing.finding import Finding
from sphero_probe.protocol.address import PRIMARY, WILDCARD
from sphero_probe.protocol.codec import Codec
from sphero_probe.runs.sides import Entry, Key, Side, Standing, node_of
from sphero_probe.simulator import Fact

CATALOGUE: Final = "catalogue"
"""Names the catalogue as a side."""


def catalogue_side(robot: Robot) -> Side:
    """Return what the catalogue knows of a model; a command of which it knows no node is at the usual one."""
    entries: dict[Key, Entry] = {}
    for row in commands_of(robot):
        if row.kind is Kind.COMMAND:
            entry = Entry(Standing.EXISTS, row.name, row.risk)
            nodes = (row.nodes[robot.key] or (PRIMARY,)) if robot.addressed else (None,)
            entries |= {(node, row.did, row.cid): entry for node in nodes}
    return _side(CATALOGUE, CATALOGUE, robot, "", entries)


def firmware_side(source: str, robot: Robot, device: str, facts: Iterable[Fact]) -> Side:
    """Return what the firmware of a built-in robot has.

    Args:
        source: the address, as the user wrote it.
        robot: the model.
        device: the robot's name.
        facts: every command that exists.
    """
    entries = {
        (fact.node if robot.addressed else None, fact.did, fact.cid): Entry(
            Standing.EXISTS, _name(robot, fact.did, fact.cid), fact.risk
        )
        for fact in facts
    }
    return _side(source, "fake", robot, device, entries)


def _name(robot: Robot, did: int, cid: int) -> str | None:
    row = lookup(robot.generation, did, cid, robot)
    return row.name if row else None


def _side(source: str, kind: str, robot: Robot, device: str, entries: dict[Key, Entry]) -> Side:
    def covers(key: Key) -> bool:
        return key[0] not in (None, WILDCARD) if robot.addressed else key[0] is None

    return Side(
        source,
        kind,
        robot.generation,
        robot.key,
        robot.name,
        device,
        {},
        "",
        True,
        entries,
        covers,
    )


def claims_side(
    source: str, robot: Robot | None, device: str, findings: Sequence[Finding], codec: Codec
) -> Side:
    """Return what a robot lists as its own.

    Args:
        source: the address, as the user wrote it.
        robot: the model, None if it is not known.
        device: the robot's name.
        findings: the answers to the questions for its devices and commands.
        codec: of the robot's protocol.

    Raises:
        UsageError: the robot gave no list.
    """
    claims = claims_of(findings, codec)
    if not claims.listed:
        raise UsageError(
            f"{source}: this robot does not list its commands",
            "compare a run of it: sphero-probe discover, then the run's name",
        )
    nodes = {node_of(target) for target in claims.nodes}
    devices = {(node_of(target), did) for target, did in claims.devices}
    listed = {(node_of(target), did) for target, did in claims.listed}
    entries: dict[Key, Entry] = {}
    for target, did, cid in claims.commands:
        row = lookup(codec.generation, did, cid, robot)
        key = (node_of(target), did, cid)
        entries[key] = Entry(Standing.EXISTS, row.name if row else None)

    def covers(key: Key) -> bool:
        node, did, _ = key
        return (node, did) in listed or (node in nodes and (node, did) not in devices)

    known, model = (robot.key, robot.name) if robot else ("", "")
    return Side(source, "claims", codec.generation, known, model, device, {}, "", True, entries, covers)
