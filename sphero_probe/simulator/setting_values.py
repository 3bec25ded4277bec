"""Read the values of a fake robot's settings; a ``ValueError`` says what is wanted."""

import math
import re
from collections.abc import Callable
from enum import StrEnum
from typing import Final

from sphero_probe.simulator.topology import NUMBERS

_UNITS: Final = {"ms": 0.001, "s": 1.0, "m": 60.0, "min": 60.0}
_QUANTITY: Final = re.compile(r"(\d+(?:\.\d*)?|\.\d+)([a-z]*)", re.ASCII)


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """Return a reader of whole numbers within bounds."""

    def read(text: str) -> int:
        number = _number(text)
        if number < least or (most is not None and number > most):
            bounds = f"from {least} up" if most is None else f"from {least} to {most}"
            raise ValueError(f"a whole number {bounds} is wanted")
        return number

    return read


def _number(text: str) -> int:
    digits = text.lower().removeprefix("0x")
    base = 10 if digits == text.lower() else 16
    if re.fullmatch("[0-9a-f]{1,18}" if base == 16 else "[0-9]{1,18}", digits) is None:
        raise ValueError("a whole number is wanted, such as 3 or 0x1f")
    return int(digits, base)


def probability(text: str) -> float:
    """Read a number from 0 to 1."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= 1:
        raise ValueError("a probability from 0 to 1 is wanted")
    return value


def seconds(text: str) -> float:
    """Read a time with its unit, in seconds."""
    found = _QUANTITY.fullmatch(text)
    if found is None or (found[2] and found[2] not in _UNITS):
        raise ValueError("a time is wanted, such as 15ms or 0.5s")
    if not found[2]:
        raise ValueError(f"a time needs its unit: {text}ms or {text}s")
    return float(found[1]) * _UNITS[found[2]]


def at_least(least: str) -> Callable[[str], float]:
    """Return a reader of times that are not shorter than one, in seconds."""

    def read(text: str) -> float:
        time = seconds(text)
        if time < seconds(least):
            raise ValueError(f"a time of {least} or more is wanted")
        return time

    return read


def one_of(words: type[StrEnum]) -> Callable[[str], StrEnum]:
    """Return a reader of the words of an enumeration."""

    def read(text: str) -> StrEnum:
        if text not in [word.value for word in words]:
            raise ValueError(f"one of {', '.join(words)} is wanted")
        return words(text)

    return read


def switch(text: str) -> bool:
    """Read 0 or 1."""
    if text not in ("0", "1"):
        raise ValueError("0 or 1 is wanted")
    return text == "1"


def pairs(text: str) -> frozenset[tuple[int, int]]:
    """Read commands with a comma between them."""
    try:
        return frozenset(pair(word) for word in text.split(","))
    except ValueError as error:
        raise ValueError(f"{error}; several with a comma between them") from None


def pair(text: str) -> tuple[int, int]:
    """Read the device id and command id of a command."""
    try:
        did, cid = (_number(word) for word in text.split(":"))
    except ValueError:
        did = cid = -1
    if not (0 <= did <= 0xFF and 0 <= cid <= 0xFF):
        raise ValueError("DID:CID is wanted, such as 0x13:0x10")
    return did, cid


def devices(text: str) -> frozenset[int]:
    """Read device ids: 1 for all, 0 for none, or a list."""
    if text in ("0", "1"):
        return frozenset(range(256)) if text == "1" else frozenset()
    try:
        dids = frozenset(_number(word) for word in text.split(","))
    except ValueError:
        dids = frozenset({-1})
    if not all(0 <= did <= 0xFF for did in dids):
        raise ValueError("0, 1 or device ids such as 0x13,0x17 are wanted")
    return dids


def node(text: str) -> int:
    """Read the number of a node."""
    return whole(NUMBERS[0], NUMBERS[-1])(text)


def nodes(text: str) -> frozenset[int]:
    """Read numbers of nodes with a comma between them."""
    return frozenset(node(word) for word in text.split(","))


def path(text: str) -> str:
    """Read a file name."""
    if not text:
        raise ValueError("a file name is wanted")
    return text
