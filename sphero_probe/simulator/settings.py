"""What follows ``fake:`` in an address comes in as text, a fake robot's settings go out."""

import math
import re
from collections.abc import Callable
from enum import StrEnum
from typing import Any, Final, NamedTuple
from urllib.parse import parse_qsl

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import UsageError, nearest
from sphero_probe.simulator.response_style import RESPONSE_STYLES

MOST_HIDDEN: Final = 500
"""Hidden commands that any robot has room for."""

_UNITS: Final = {"ms": 0.001, "s": 1.0, "m": 60.0, "min": 60.0}
_QUANTITY: Final = re.compile(r"(\d+(?:\.\d*)?|\.\d+)([a-z]*)", re.ASCII)


class Strict(StrEnum):
    """How a firmware checks the length of a payload."""

    EXACT = "exact"
    MINIMUM = "minimum"
    NONE = "none"


class Claims(StrEnum):
    """How far 10/05 and 10/06 tell the truth about the firmware."""

    TRUE = "true"
    PARTIAL = "partial"
    LYING = "lying"
    NONE = "none"


class Overflow(StrEnum):
    """What becomes of a command that finds no place to wait."""

    LOST = "lost"
    BUSY = "busy"


class Settings(NamedTuple):
    """Everything that makes one fake robot differ from another; equal settings behave alike, byte for byte.

    Attributes:
        model: the robot that is played.
        seed: picks names, readings, hidden commands and faults.
        hidden: number of commands that no catalogue knows.
        strict: how the length of a payload is checked.
        mask: devices in which a payload answers "bad length" even where no such command exists.
        claims: what 10/05 and 10/06 are worth.
        latency: seconds between hearing a command and its answer leaving.
        loss: probability that a packet is lost, either way.
        corrupt: probability that one byte of a packet is changed, either way.
        duplicate: probability that a packet of the robot arrives twice.
        reorder: probability that an answer is overtaken by the next one.
        interval: seconds between BLE connection events; None for no events, or the usual ones if
            ``per_event`` is set.
        per_event: packets per event and direction at most; None for the usual number if ``interval`` is set.
        queue: commands that can wait while one is served; None where service takes no time.
        overflow: what becomes of the surplus: it is lost, or answered "busy" at once.
        service: seconds that serving one command takes; None for the usual time if ``queue`` is set.
        busy: probability that a command is answered "busy" and not executed.
        sleep_after: seconds without activity until the robot sleeps; None for what its generation does.
        matrix: a BOLT+ has the 8x8 matrix of the BOLT on its one node; other robots are as they are.
        disconnect_after: commands heard on one connection until it drops; None for a connection that lasts.
        reboot_on: (did, cid) that makes the robot start anew, whatever the payload.
        split: bytes per notification, None for as many as one BLE notification holds.
        silent: (did, cid) pairs that are never answered.
        truth: file for the list of commands that exist; whoever carries the bytes writes it.
        ledger: file for the list of commands executed, likewise.
    """

    model: Robot
    seed: int = 0
    hidden: int = 0
    strict: Strict = Strict.EXACT
    mask: frozenset[int] = frozenset()
    claims: Claims = Claims.TRUE
    latency: float = 0.0
    loss: float = 0.0
    corrupt: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    interval: float | None = None
    per_event: int | None = None
    queue: int | None = None
    overflow: Overflow = Overflow.LOST
    service: float | None = None
    busy: float = 0.0
    sleep_after: float | None = None
    matrix: bool = False
    disconnect_after: int | None = None
    reboot_on: tuple[int, int] | None = None
    split: int | None = None
    silent: frozenset[tuple[int, int]] = frozenset()
    truth: str | None = None
    ledger: str | None = None


def parse_settings(text: str) -> Settings:
    """Read ``MODEL?key=value&…``; values may be percent-encoded.

    Raises:
        UsageError: an unknown model or key, a key given twice, a value that does not fit its key.
    """
    word, _, query = text.partition("?")
    values: dict[str, Any] = {}
    plus_kept = query.replace("+", "%2B")  # parse_qsl would read a plus sign as a blank, as web forms do
    for key, value in parse_qsl(plus_kept, keep_blank_values=True):
        if key not in KEYS:
            raise UsageError(_unknown("setting", key, list(KEYS)))
        if key in values:
            raise UsageError(f"fake robot setting {key} is given twice")
        try:
            values[key] = KEYS[key](value)
        except ValueError as error:
            raise UsageError(f"fake robot setting {key}={value}: {error}") from None
    return Settings(_model(word), **values)


def _model(word: str) -> Robot:
    robot = robot_by_word(word)
    playable = [model.key for model in ROBOTS.values() if model.generation in RESPONSE_STYLES]
    if robot is None:
        raise UsageError(_unknown("robot", word, playable))
    if robot.generation not in RESPONSE_STYLES:
        raise UsageError(f"there is no fake {robot.key} yet; there are {', '.join(playable)}")
    return robot


def _unknown(kind: str, word: str, known: list[str]) -> str:
    near = nearest(word.lower(), known)
    guess = f" did you mean {near[0]}?" if near else ""
    return f"unknown fake {kind} {word!r};{guess} there are {', '.join(known)}"


def _whole(least: int, most: int | None = None) -> Callable[[str], int]:
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


def _probability(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= 1:
        raise ValueError("a probability from 0 to 1 is wanted")
    return value


def _seconds(text: str) -> float:
    found = _QUANTITY.fullmatch(text)
    if found is None or (found[2] and found[2] not in _UNITS):
        raise ValueError("a time is wanted, such as 15ms or 0.5s")
    if not found[2]:
        raise ValueError(f"a time needs its unit: {text}ms or {text}s")
    return float(found[1]) * _UNITS[found[2]]


def _at_least(least: str) -> Callable[[str], float]:
    def read(text: str) -> float:
        seconds = _seconds(text)
        if seconds < _seconds(least):
            raise ValueError(f"a time of {least} or more is wanted")
        return seconds

    return read


def _one_of(words: type[StrEnum]) -> Callable[[str], StrEnum]:
    def read(text: str) -> StrEnum:
        if text not in [word.value for word in words]:
            raise ValueError(f"one of {', '.join(words)} is wanted")
        return words(text)

    return read


def _switch(text: str) -> bool:
    if text not in ("0", "1"):
        raise ValueError("0 or 1 is wanted")
    return text == "1"


def _pairs(text: str) -> frozenset[tuple[int, int]]:
    try:
        return frozenset(_pair(word) for word in text.split(","))
    except ValueError as error:
        raise ValueError(f"{error}; several with a comma between them") from None


def _pair(text: str) -> tuple[int, int]:
    try:
        did, cid = (_number(word) for word in text.split(":"))
    except ValueError:
        did = cid = -1
    if not (0 <= did <= 0xFF and 0 <= cid <= 0xFF):
        raise ValueError("DID:CID is wanted, such as 0x13:0x10")
    return did, cid


def _masked(text: str) -> frozenset[int]:
    """Read the devices that mask: 1 for all, 0 for none, or a list of device ids."""
    if text in ("0", "1"):
        return frozenset(range(256)) if text == "1" else frozenset()
    try:
        dids = frozenset(_number(word) for word in text.split(","))
    except ValueError:
        dids = frozenset({-1})
    if not all(0 <= did <= 0xFF for did in dids):
        raise ValueError("0, 1 or device ids such as 0x13,0x17 are wanted")
    return dids


def _path(text: str) -> str:
    if not text:
        raise ValueError("a file name is wanted")
    return text


KEYS: Final[dict[str, Callable[[str], object]]] = {
    "seed": _whole(0),
    "hidden": _whole(0, MOST_HIDDEN),
    "strict": _one_of(Strict),
    "mask": _masked,
    "claims": _one_of(Claims),
    "latency": _seconds,
    "loss": _probability,
    "corrupt": _probability,
    "duplicate": _probability,
    "reorder": _probability,
    "interval": _at_least("1ms"),
    "per_event": _whole(1),
    "queue": _whole(1),
    "overflow": _one_of(Overflow),
    "service": _seconds,
    "busy": _probability,
    "sleep_after": _at_least("1ms"),
    "matrix": _switch,
    "disconnect_after": _whole(1),
    "reboot_on": _pair,
    "split": _whole(1, 512),
    "silent": _pairs,
    "truth": _path,
    "ledger": _path,
}
"""Every setting by its name in the address, which is its name in ``Settings``, and how its value is read."""
