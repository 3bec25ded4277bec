"""Formats the addresses in rows as text for people: which node was asked, and which one answered."""

from typing import Final

from sphero_probe.catalogue.addresses import Use, address_meaning
from sphero_probe.protocol.address import Address
from sphero_probe.reports.phrases import Data, hex_id

_BYTE: Final = 0xFF


def addresses(data: Data) -> str:
    """Return the addresses of a packet: ``0x12 to 0x01``, ``to 0x12``, ``from 0x12``."""
    source, target = hex_id(data.get("source")), hex_id(data.get("target"))
    if source and target:
        return f"{source} to {target}"
    return f"to {target}" if target else f"from {source}" if source else ""


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
    return Address.from_byte(source).node != Address.from_byte(target).node


def _in_words(byte: object, use: Use) -> str:
    if not isinstance(byte, int) or not 0 <= byte <= _BYTE:
        return hex_id(byte)
    return f"{hex_id(byte)}: {address_meaning(byte, use).words}"
