"""Parses one command typed as words, for ``send`` and ``listen --send``."""

from sphero_probe.catalogue.naming import command_id, device_id, pair
from sphero_probe.cli.messages import say
from sphero_probe.cli.parse import hex_bytes
from sphero_probe.errors import UsageError
from sphero_probe.protocol.packets import Generation


def parse_command(what: tuple[str, ...], generation: Generation) -> tuple[tuple[int, int], bytes | None]:
    """Return DID and CID, and the argument bytes, None where there are none.

    Args:
        what: ``0x13 0x10 [HEX]``, ``0x13:0x10 [HEX]`` or ``NAME [HEX]``.
        generation: the protocol whose names are used.

    Raises:
        UsageError: the words are not a command.
    """
    if not what:
        raise UsageError("no command is given", "for example: sphero-probe send 0x13 0x10")
    first, *rest = what
    if first[:1].isdigit() and ":" not in first:
        if not rest:
            raise UsageError("a DID alone is not a command", "add the CID: sphero-probe send 0x13 0x10")
        second = rest.pop(0)
        ids = device_id(first, generation), command_id(second, generation)
        if any(_may_be_meant_as_hex(number) for number in (first, second)):
            say(f"note: {first} {second} is read as decimal: 0x{ids[0]:02x}:0x{ids[1]:02x}")
    else:
        ids = pair(first, generation)
    return ids, hex_bytes(" ".join(rest), "payload") if rest else None


def _may_be_meant_as_hex(number: str) -> bool:
    """Whether a number without 0x is another number in hexadecimal."""
    return number.isdecimal() and len(number) > 1
