"""Turn what bleak, D-Bus and the system raise into errors that a person can act on."""

import asyncio
import errno
import re
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Final

from bleak.exc import (
    BleakBluetoothNotAvailableError,
    BleakDBusError,
    BleakDeviceNotFoundError,
    BleakError,
    BleakGATTProtocolError,
)

from sphero_probe.errors import (
    ConnectionFailedError,
    NoSuchAdapterError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
)
from sphero_probe.transports.base import TRY_FAKE, WHY_UNHEARD
from sphero_probe.transports.ble.wording import (
    BUS_DIED,
    DBUS,
    LOCKED_OUT,
    MUTE,
    NEARER,
    NEVER_RESOLVED,
    NO_ADAPTER,
    NO_BUS,
    NOT_AVAILABLE,
    NOT_THERE,
    TEXTS,
    UNREACHABLE,
    Words,
    att_words,
)

GRACE: Final = 2.0
"""Seconds beyond its own time that a scan may take before it is cut off."""
LONGEST: Final = 200
"""Characters of a foreign text that a message shows at most."""
_ASK_ADAPTERS: Final = 1.0
"""Seconds for finding out which adapters there are, once something is wrong already."""

_NO_SUCH_ADAPTER = re.compile(r"adapter '([^']*)' not found")
_NO_SUCH_DEVICE = re.compile(r"device '.*not found", re.DOTALL)
_IN_DISCOVERY = re.compile(r"discover|get gatt (services|characteristics|descriptors)", re.IGNORECASE)
_CLOSED: Final = (errno.EBADF, errno.ENOTCONN)


def explain(error: BaseException, step: str, platform: str = sys.platform) -> SpheroProbeError:
    """Return the error to show for what a step of reaching a robot raised.

    Args:
        error: anything that bleak is known to raise, an ``OSError`` or a ``TimeoutError``.
        step: what was being done: scan, connect, services, handshake, notify, write.
        platform: as ``sys.platform`` has it.
    """
    told = _explain(error, step, platform)
    if step == "scan" and isinstance(told, ConnectionFailedError):
        return UnavailableError(str(told), told.hint)  # no robot is to blame yet
    return told


def _explain(error: BaseException, step: str, platform: str) -> SpheroProbeError:
    match error:
        case SpheroProbeError():
            return error
        case BleakBluetoothNotAvailableError():
            words = NOT_AVAILABLE.get(error.reason)
            said = f"Bluetooth is not available: {_first(error)}"
            return words.on(platform) if words else UnavailableError(said, TRY_FAKE)
        case BleakDeviceNotFoundError():
            return RobotNotFoundError(f"{step}: {NOT_THERE}", WHY_UNHEARD)
        case BleakGATTProtocolError():
            return att_words(int(error.code)).on(platform, step)
        case BleakDBusError():
            return _explain_dbus(error, step, platform)
        case BleakError():
            return _explain_text(_first(error), step, platform)
        case TimeoutError() if not error.errno:
            words = {"scan": MUTE, "services": NEVER_RESOLVED}.get(step, UNREACHABLE)
            return words.on(platform, step)
        case _:
            return _explain_system(error, step, platform)


def _first(error: BaseException) -> str:
    """The first argument as text; ``str()`` of an error with several shows a tuple."""
    return str(error.args[0])[:LONGEST] if error.args else type(error).__name__


def _before(step: str, words: Words) -> str:
    """The step where it tells something: which one it was is no news of a machine that is not ready."""
    return "" if issubclass(words.kind, UnavailableError) else step


def _explain_dbus(error: BleakDBusError, step: str, platform: str) -> SpheroProbeError:
    name = _first(error)
    for part in name.split("."):
        if words := DBUS.get(part):
            return words.on(platform, _before(step, words))
    details = error.args[1] if len(error.args) > 1 and isinstance(error.args[1], str) else ""
    return _explain_text(details[:LONGEST] or name, step, platform)


def _explain_text(text: str, step: str, platform: str) -> SpheroProbeError:
    if missing := _NO_SUCH_ADAPTER.search(text):
        return NoSuchAdapterError(missing[1])
    if _NO_SUCH_DEVICE.match(text):
        return RobotNotFoundError(f"{step}: {NOT_THERE}", WHY_UNHEARD)
    if step == "connect" and _IN_DISCOVERY.search(text):
        step = "services"
    folded = text.casefold()
    for piece, words in TEXTS:
        if piece in folded:
            return words.on(platform, _before(step, words))
    return ConnectionFailedError(f"{step}: {text}", NEARER)


def _explain_system(error: BaseException, step: str, platform: str) -> SpheroProbeError:
    """Explain what the system and D-Bus raise; outside Linux it speaks of the robot, there of the bus."""
    kinds = {kind.__name__ for kind in type(error).__mro__}
    if "InvalidAddressError" in kinds:
        return UnavailableError(
            "the address of the system bus makes no sense", "check DBUS_SYSTEM_BUS_ADDRESS"
        )
    if "AuthError" in kinds:
        return LOCKED_OUT.on(platform)
    if isinstance(error, PermissionError):
        return UnavailableError("the system bus refuses this user", "run as a user in the group bluetooth")
    text = getattr(error, "strerror", None) or _first(error)
    if platform == "win32" and step != "scan":
        return ConnectionFailedError(f"{step}: {text[:LONGEST]}", NEARER)
    if isinstance(error, FileNotFoundError | ConnectionRefusedError):
        return UnavailableError("Bluetooth cannot be reached: no system bus", NO_BUS)
    if isinstance(error, EOFError | ConnectionError) or getattr(error, "errno", None) in _CLOSED:
        return BUS_DIED.on(platform)
    return UnavailableError(
        f"{step}: {text[:LONGEST]}", "is the system bus where DBUS_SYSTEM_BUS_ADDRESS says? " + TRY_FAKE
    )


def _raised() -> tuple[type[BaseException], ...]:
    known: tuple[type[BaseException], ...] = (BleakError, OSError, TimeoutError, EOFError)
    try:
        from dbus_fast.errors import DBusFastError
    except ImportError:  # pragma: no cover - macOS, Windows
        return known
    return (*known, DBusFastError)


RAISED: Final = _raised()
"""Everything that bleak lets through; dbus-fast exists on Linux only."""


@dataclass(slots=True)
class Step:
    """What is being done.

    Attributes:
        name: scan, connect, services, handshake, notify, write; may change underway.
    """

    name: str


@asynccontextmanager
async def step(name: str, seconds: float) -> AsyncIterator[Step]:
    """Bound a step of reaching a robot in time, and explain what it raises.

    Args:
        name: of the step.
        seconds: for all of it. A step to connect keeps its own time, so if this bound passes there, the
            Bluetooth service hangs and not the robot.

    Raises:
        SpheroProbeError: whatever went wrong, in words.
    """
    doing = Step(name)
    bound = asyncio.timeout(seconds)
    try:
        async with bound:
            yield doing
    except RAISED as error:
        if isinstance(error, TimeoutError) and bound.expired() and name == "connect":
            raise MUTE.on(sys.platform, doing.name) from error
        told = explain(error, doing.name)
        if isinstance(told, NoSuchAdapterError):
            raise await _name_the_others(told) from error
        raise told from error


async def _name_the_others(error: NoSuchAdapterError) -> UnavailableError:
    """Add to the adapter that is missing those that are there, as far as that can be found out."""
    try:
        from sphero_probe.transports.ble.machine import adapters

        async with asyncio.timeout(_ASK_ADAPTERS):
            there = await adapters(_ASK_ADAPTERS)
    except RAISED:
        return error
    except ImportError:  # pragma: no cover - macOS, Windows
        return error
    if not there:
        return UnavailableError(NO_ADAPTER, "plug one in, " + TRY_FAKE)
    names = ", ".join(one.name if one.powered else f"{one.name} (off)" for one in there)
    best = next((one for one in there if one.powered and one.central), there[0])
    return NoSuchAdapterError(error.name, f"there are: {names}; choose one with --adapter {best.name}")
