"""Formats the addresses in rows as text for people: which node was asked, and which one answered."""

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Final

from sphero_probe.catalogue.addresses import Use, address_meaning
from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.finding import Outcome
from sphero_probe.protocol.address import Address
from sphero_probe.reports.phrases import Data, hex_id, shown

_BYTE: Final = 0xFF
_COMMAND_USES: Final = {"target": Use.COMMAND_TARGET, "source": Use.COMMAND_SOURCE}
_ANSWER_USES: Final = {"target": Use.ANSWER_TARGET, "source": Use.ANSWER_SOURCE}


def addresses(data: Data) -> str:
    """Return the addresses of a packet: ``0x12 to 0x01``, ``to 0x12``, ``from 0x12``."""
    source, target = hex_id(data.get("source")), hex_id(data.get("target"))
    if source and target:
        return f"{source} to {target}"
    return f"to {target}" if target else f"from {source}" if source else ""


def legend(data: Data) -> Iterator[str]:
    """Yield each address of a packet in words: ``0x12, target of a command: port 1, node 2: …``."""
    uses = _COMMAND_USES if data.get("kind") == "command" else _ANSWER_USES
    for key, use in uses.items():
        if words := shown(data.get(f"{key}_means")):
            yield f"{hex_id(data.get(key))}, {use.value}: {words}"


def node_asked(data: Data) -> str:
    """Return the node that a command was sent to: ``0x12: port 1, node 2: node 2 of the robot, …``."""
    return _in_words(data.get("target"), Use.COMMAND_TARGET)


def answered_by(data: Data) -> str:
    """Return the node that answered, empty where it is the one that was asked."""
    return _in_words(data.get("answered_by"), Use.ANSWER_SOURCE) if answered_elsewhere(data) else ""


def answered_elsewhere(data: Data) -> bool:
    """Whether another node answered than was asked; the wildcard and no address ask for no particular one."""
    source, target = data.get("answered_by"), data.get("target")
    if not isinstance(source, int) or not 0 <= source <= _BYTE:
        return False
    if not isinstance(target, int) or not 0 <= target <= _BYTE:
        return True
    return _differ(source, target)


@cache
def _differ(source: int, target: int) -> bool:
    """Whether two address bytes name different nodes; a run has few of them, and very many findings."""
    return Address.from_byte(source).node != Address.from_byte(target).node


def other_nodes(findings: Iterable[Data], robot: Robot | None) -> list[str]:
    """Return the nodes that answered in place of the one that was asked, in words, each once.

    Findings of absent nodes are left out: some other node always says that they are absent.
    """
    told = (
        _in_words(data.get("answered_by"), Use.ANSWER_SOURCE, robot)
        for data in findings
        if data.get("target") is not None and answered_elsewhere(data)
        if data.get("outcome") != Outcome.ABSENT.value
    )
    return [f"Answered for another node: {words}" for words in dict.fromkeys(told)]


def _in_words(byte: object, use: Use, robot: Robot | None = None) -> str:
    if not isinstance(byte, int) or not 0 <= byte <= _BYTE:
        return hex_id(byte)
    return f"{hex_id(byte)}: {address_meaning(byte, use, robot).words}"
