"""What people type becomes values: ids, ranges, names, hex bytes, colours, nodes."""

import re
from collections.abc import Iterable
from typing import Final

from sphero_probe.catalogue import close_names, device_by_name, row_by_name
from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import UsageError
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Generation

_NUMBER: Final = re.compile(r"0[xX][0-9a-fA-F]{1,8}|[0-9]{1,10}")
_HEX: Final = re.compile(r"[0-9a-fA-F]*")
_COLOUR: Final = re.compile(r"#?([0-9a-fA-F]{6}|[0-9a-fA-F]{3})")
_SEPARATORS: Final = re.compile(r"[\s:_,]|0[xX]")


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
        raise UsageError(f"no device named '{text}'", _suggestion(text, generation, devices=True))
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
        raise UsageError(f"no command named '{text}'", _suggestion(text, generation))
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
        raise UsageError(f"no command named '{text}'", _suggestion(text, generation))
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
    """Return the bytes of ``8d0a13``, ``8d 0a 13``, ``8d:0a:13`` or ``0x8d 0x0a``.

    Raises:
        UsageError: not hexadecimal, or an odd number of digits.
    """
    digits = _SEPARATORS.sub("", text)
    if not _HEX.fullmatch(digits):
        raise UsageError(f"{what}: '{text}' is not hexadecimal")
    if len(digits) % 2:
        raise UsageError(f"{what}: an odd number of hex digits ({len(digits)})", "two digits make a byte")
    return bytes.fromhex(digits)


def is_hex(text: str) -> bool:
    """Whether this can only be meant as hex bytes, well written or not."""
    return bool(text) and bool(_HEX.fullmatch(_SEPARATORS.sub("", text)))


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
    if text in known:
        return text
    from difflib import get_close_matches

    close = get_close_matches(text, known, n=1)
    raise UsageError(
        f"no {what} '{text}'", f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known)}"
    )


def _suggestion(text: str, generation: Generation, *, devices: bool = False) -> str:
    if devices:
        from difflib import get_close_matches

        from sphero_probe.catalogue import DEVICE_NAMES

        names = list(DEVICE_NAMES[generation].values())
        close = get_close_matches(text, names, n=1)
        return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"
    near = close_names(generation, text)
    return f"did you mean '{near[0]}'?" if near else "see: sphero-probe catalog"
