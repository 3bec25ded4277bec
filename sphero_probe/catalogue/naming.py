"""Parses ids, command names and colours as people write them.

The command line and the Python API both use these functions, so that both accept the same names and make the
same suggestions.
"""

import re
from collections.abc import Iterable
from typing import Final

from sphero_probe.catalogue.colours import COLOURS
from sphero_probe.catalogue.commands import DEVICE_NAMES, close_names, device_by_name, row_by_name
from sphero_probe.errors import UsageError, did_you_mean
from sphero_probe.protocol.packets import Generation

NUMBER: Final = re.compile(r"0[xX][0-9a-fA-F]{1,8}|[0-9]{1,10}")
_COLOUR: Final = re.compile(r"#?([0-9a-fA-F]{6}|[0-9a-fA-F]{3})")


def byte(text: str, what: str) -> int:
    """Return a number from 0 to 255 written as ``0x13`` or ``19``.

    Raises:
        UsageError: it is not such a number.
    """
    text = text.strip()
    if not NUMBER.fullmatch(text):
        raise UsageError(f"{what}: '{text}' is not a number", "write it as 0x13 or 19")
    value = int(text, 0 if text[:2].lower() == "0x" else 10)
    if value > 0xFF:
        raise UsageError(f"{what}: {text} is larger than 0xff")
    return value


def device_id(text: str, generation: Generation) -> int:
    """Return a DID written as a number or a device name.

    Raises:
        UsageError: it is neither; a similar name is suggested.
    """
    if NUMBER.fullmatch(text.strip()):
        return byte(text, "DID")
    did = device_by_name(generation, text)
    if did is None:
        raise UsageError(f"no device named '{text}'", did_you_mean(text, DEVICE_NAMES[generation].values()))
    return did


def command_id(text: str, generation: Generation) -> int:
    """Return a CID written as a number or a command's name.

    Raises:
        UsageError: it is neither; a similar name is suggested.
    """
    if NUMBER.fullmatch(text.strip()):
        return byte(text, "CID")
    row = row_by_name(generation, text)
    if row is None:
        raise UsageError(f"no command named '{text}'", _near_command(text, generation))
    return row.cid


def pair(text: str, generation: Generation) -> tuple[int, int]:
    """Return DID and CID written as ``0x13:0x10`` or as a command's name.

    Raises:
        UsageError: it is neither; a similar name is suggested.
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
        UsageError: a part is not an id, or a range runs backwards.
    """
    one = device_id if devices else command_id
    ids: dict[int, None] = {}
    for part in text.split(","):
        first, dash, last = part.partition("-")
        if dash and NUMBER.fullmatch(first.strip()):
            low, high = one(first, generation), one(last, generation)
            if low > high:
                raise UsageError(
                    f"the range {part.strip()} runs backwards", f"write {last.strip()}-{first.strip()}"
                )
            ids.update(dict.fromkeys(range(low, high + 1)))
        else:
            ids[one(part, generation)] = None
    return tuple(ids)


def colour(text: str) -> tuple[int, int, int]:
    """Return red, green and blue of ``ff0000``, ``f00`` or ``orange``.

    Raises:
        UsageError: it is not a colour.
    """
    match = _COLOUR.fullmatch(COLOURS.get(text.strip().lower(), text.strip()))
    if not match:
        hint = did_you_mean(text.lower(), COLOURS, "write ff0000, f00 or a name like red")
        raise UsageError(f"'{text}' is not a colour", hint)
    digits = match[1] if len(match[1]) == 6 else "".join(digit * 2 for digit in match[1])
    red, green, blue = bytes.fromhex(digits)
    return red, green, blue


def choose(text: str, known: Iterable[str], what: str) -> str:
    """Return the word if it is known.

    Raises:
        UsageError: it is not; a similar one is suggested.
    """
    known = list(known)
    if text not in known:
        raise UsageError(f"no {what} '{text}'", did_you_mean(text, known))
    return text


def _near_command(text: str, generation: Generation) -> str:
    near = close_names(generation, text)
    return f"did you mean '{near[0]}'?" if near else "see: sphero-probe catalog"
