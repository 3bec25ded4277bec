"""Reading what people type: ids, ranges, names, hex bytes, colours, nodes."""

import re
from collections.abc import Iterable
from typing import Final

from sphero_probe.catalogue import DEVICE_NAMES, close_names, device_by_name, row_by_name
from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import UsageError, did_you_mean
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Generation

_NUMBER: Final = re.compile(r"0[xX][0-9a-fA-F]{1,8}|[0-9]{1,10}")
_COLOUR: Final = re.compile(r"#?([0-9a-fA-F]{6}|[0-9a-fA-F]{3})")
HEX_SEPARATOR: Final = re.compile(r"[\s:_,]+")
HEX_TOKEN: Final = re.compile(r"(?:0[xX])?([0-9a-fA-F]+)")
_SHOWN: Final = 16
"""Characters of a wrong token that a message shows."""


def byte(text: str, what: str) -> int:
    """Return a number from 0 to 255 written as ``0x13`` or ``19``.

    Raises:
        UsageError: it is none.
    """
    text = text.strip()
    if not _NUMBER.fullmatch(text):
        raise UsageError(f"{what}: '{text}' is not a number", "write it as 0x13 or 19")
    value = int(text, 0 if text[:2].lower() == "0x" else 10)
    if value > 0xFF:
        raise UsageError(f"{what}: {text} is larger than 0xff")
    return value


def device_id(text: str, generation: Generation) -> int:
    """Return a DID written as a number or a device name.

    Raises:
        UsageError: neither; a near name is suggested.
    """
    if _NUMBER.fullmatch(text.strip()):
        return byte(text, "DID")
    did = device_by_name(generation, text)
    if did is None:
        raise UsageError(f"no device named '{text}'", did_you_mean(text, DEVICE_NAMES[generation].values()))
    return did


def command_id(text: str, generation: Generation) -> int:
    """Return a CID written as a number or a command's name.

    Raises:
        UsageError: neither; a near name is suggested.
    """
    if _NUMBER.fullmatch(text.strip()):
        return byte(text, "CID")
    row = row_by_name(generation, text)
    if row is None:
        raise UsageError(f"no command named '{text}'", _near_command(text, generation))
    return row.cid


def pair(text: str, generation: Generation) -> tuple[int, int]:
    """Return DID and CID written as ``0x13:0x10`` or as a command's name.

    Raises:
        UsageError: neither; a near name is suggested.
    """
    did, colon, cid = text.partition(":")
    if colon:
        return device_id(did, generation), command_id(cid, generation)
    row = row_by_name(generation, text)
    if row is None:
        raise UsageError(f"no command named '{text}'", _near_command(text, generation))
    return row.did, row.cid


def id_range(text: str, generation: Generation, *, devices: bool) -> tuple[int, ...]:
    """Return the ids of ``0x10-0x1a,0x1f,power``, in order, each once.

    Raises:
        UsageError: a part is no id, or a range runs backwards.
    """
    one = device_id if devices else command_id
    ids: dict[int, None] = {}
    for part in text.split(","):
        first, dash, last = part.partition("-")
        if dash and _NUMBER.fullmatch(first.strip()):
            low, high = one(first, generation), one(last, generation)
            if low > high:
                raise UsageError(
                    f"the range {part.strip()} runs backwards", f"write {last.strip()}-{first.strip()}"
                )
            ids.update(dict.fromkeys(range(low, high + 1)))
        else:
            ids[one(part, generation)] = None
    return tuple(ids)


def hex_bytes(text: str, what: str) -> bytes:
    """Return the bytes that a text of hex tokens stands for.

    Blanks, colons, commas and underscores separate tokens, and each token stands for whole bytes: ``0102``,
    ``01 02``, ``0x01 0x02`` and ``1 2`` are the same. A token of one digit is one byte.

    Args:
        text: the tokens.
        what: the text's name, for messages.

    Raises:
        UsageError: it is not hexadecimal, or a token of several digits has an odd number of them.
    """
    read = bytearray()
    for token in HEX_SEPARATOR.split(text):
        match = HEX_TOKEN.fullmatch(token)
        if match is None:
            if token:
                raise UsageError(
                    f"{what}: '{token[:_SHOWN]}' is not hexadecimal", "write bytes as 00ff or 0x00ff"
                )
            continue
        digits = match[1]
        if len(digits) % 2 and len(digits) > 1:
            raise UsageError(f"{what}: {odd_digits(token)}", two_readings(digits))
        read += bytes.fromhex(digits.zfill(2))
    return bytes(read)


def odd_digits(token: str) -> str:
    """Return what is wrong with a token that has an odd number of digits."""
    shown = token if len(token) <= _SHOWN else f"{token[:_SHOWN]}..."
    return f"'{shown}' has an odd number of hex digits"


def two_readings(digits: str) -> str:
    """Return the hint for digits that may stand for different bytes: which ones."""
    if len(digits) > _SHOWN:
        return "a digit is missing, or there is one too many"
    if len(digits) == 2:
        return f"write 0{digits[0]} 0{digits[1]} or {digits}"
    first, last = bytes.fromhex(f"0{digits}"), bytes.fromhex(f"{digits[:-1]}0{digits[-1]}")
    return f"write {first.hex(' ')} or {last.hex(' ')}"


def is_hex(text: str) -> bool:
    """Whether this can only be meant as hex bytes, well written or not."""
    return bool(text) and all(HEX_TOKEN.fullmatch(token) for token in HEX_SEPARATOR.split(text) if token)


def colour(text: str) -> tuple[int, int, int]:
    """Return red, green and blue of ``ff0000`` or ``f00``.

    Raises:
        UsageError: it is none.
    """
    match = _COLOUR.fullmatch(text.strip())
    if not match:
        raise UsageError(f"'{text}' is not a colour", "write six or three hex digits: ff0000, f00")
    digits = match[1] if len(match[1]) == 6 else "".join(digit * 2 for digit in match[1])
    red, green, blue = bytes.fromhex(digits)
    return red, green, blue


def node(text: str | None, robot: Robot | None, port: int) -> int | None:
    """Return the address byte of a node: ``primary``, ``secondary``, ``0x12``; None leaves addresses out.

    Args:
        text: what was typed; None stands for the robot's usual node.
        robot: the model, None where it is not known.
        port: the port nibble on this kind of line.

    Raises:
        UsageError: this robot has no node of that name.
    """
    if text is None:
        return Address(port, PRIMARY).byte if robot is None or robot.addressed else None
    if text == "none":
        return None
    names: dict[str, int] = {"primary": PRIMARY, "secondary": 2}
    if robot:
        names |= {name: number for number, name in robot.nodes.items()}
    if text.lower() in names:
        return Address(port, names[text.lower()]).byte
    if not _NUMBER.fullmatch(text):
        raise UsageError(f"no node named '{text}'", f"known: {', '.join(names)}, none, or a number like 0x12")
    return byte(text, "node")


def choose(text: str, known: Iterable[str], what: str) -> str:
    """Return the word if it is known.

    Raises:
        UsageError: it is not; a near one is suggested.
    """
    known = list(known)
    if text not in known:
        raise UsageError(f"no {what} '{text}'", did_you_mean(text, known))
    return text


def _near_command(text: str, generation: Generation) -> str:
    near = close_names(generation, text)
    return f"did you mean '{near[0]}'?" if near else "see: sphero-probe catalog"
