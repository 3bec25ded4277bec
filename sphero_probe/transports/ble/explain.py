"""What bleak, D-Bus and the system raise goes in; an error a person can act on comes out."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from bleak.exc import (
    BleakBluetoothNotAvailableError,
    BleakBluetoothNotAvailableReason,
    BleakDBusError,
    BleakDeviceNotFoundError,
    BleakError,
)

from sphero_probe.errors import (
    ConnectionFailedError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
)

GRACE: Final = 5.0
"""Seconds beyond its own time that a step of bleak's may take before it is cut off."""

_TRY_FAKE: Final = "or try --device fake:bolt-plus"
_NO_BUS: Final = "D-Bus is not running here (a container?): start it with bluetoothd, " + _TRY_FAKE
_WHY_NOT_FOUND: Final = "is it awake (shake it), in range, and not connected to a phone?"

_NOT_AVAILABLE: Final = {
    BleakBluetoothNotAvailableReason.NO_BLUETOOTH: (
        "this machine has no Bluetooth adapter",
        "plug one in, " + _TRY_FAKE,
    ),
    BleakBluetoothNotAvailableReason.NO_BLE_CENTRAL_ROLE: (
        "this machine's Bluetooth adapter does not do Bluetooth LE",
        "plug in one that does, " + _TRY_FAKE,
    ),
    BleakBluetoothNotAvailableReason.POWERED_OFF: (
        "Bluetooth is switched off",
        "switch it on: bluetoothctl power on (blocked? rfkill unblock bluetooth)",
    ),
    BleakBluetoothNotAvailableReason.DENIED_BY_USER: (
        "Bluetooth is denied to this program",
        "allow it in the system's privacy settings for your terminal",
    ),
    BleakBluetoothNotAvailableReason.DENIED_BY_SYSTEM: (
        "the system denies Bluetooth to this program",
        "in a user namespace set BLEAK_DBUS_AUTH_UID; on macOS allow your terminal in the privacy settings",
    ),
}

_DBUS: Final = {
    "AccessDenied": (
        "access to Bluetooth is denied",
        "add your user to the group bluetooth and log in again",
    ),
    "ServiceUnknown": ("BlueZ is not running", "install and start bluetoothd (Debian: apt install bluez)"),
    "ChildExited": ("BlueZ does not start", "look at: systemctl status bluetooth"),
}


def explain(error: BaseException, step: str) -> SpheroProbeError:
    """Return the error to show for what a step of reaching a robot raised.

    Args:
        error: anything that bleak is known to raise, an ``OSError`` or a ``TimeoutError``.
        step: what was being done: scan, connect, services, handshake, notify.
    """
    if isinstance(error, SpheroProbeError):
        return error
    if isinstance(error, BleakBluetoothNotAvailableError):
        said, hint = _NOT_AVAILABLE.get(
            error.reason, (f"Bluetooth is not available ({error.args[0]})", "look at: bluetoothctl show")
        )
        return UnavailableError(said, hint)
    if isinstance(error, BleakDeviceNotFoundError):
        return RobotNotFoundError("the robot is not there any more", _WHY_NOT_FOUND)
    if isinstance(error, BleakDBusError):
        for part, (said, hint) in _DBUS.items():
            if part in error.dbus_error:
                return UnavailableError(said, hint)
        return ConnectionFailedError(
            f"{step}: {error.dbus_error_details or error.dbus_error}", "try again, nearer to the robot"
        )
    if isinstance(error, TimeoutError):
        if step == "scan":
            return UnavailableError("scan: the Bluetooth service does not answer", "restart bluetoothd")
        return ConnectionFailedError(f"{step}: no answer in time", "try again, nearer to the robot")
    if isinstance(error, BleakError):
        text = str(error.args[0]) if error.args else "unknown error"
        if text.startswith("adapter "):
            return UnavailableError(text, "see which there are: bluetoothctl list")
        if text.startswith("device ") and text.endswith("not found"):
            return RobotNotFoundError("the robot is not there any more", _WHY_NOT_FOUND)
        return ConnectionFailedError(f"{step}: {text}", "try again, nearer to the robot")
    return _explain_system(error, step)


def _explain_system(error: BaseException, step: str) -> SpheroProbeError:
    if isinstance(error, FileNotFoundError | ConnectionRefusedError):
        return UnavailableError("Bluetooth cannot be reached: no system bus", _NO_BUS)
    if isinstance(error, PermissionError):
        return UnavailableError("the system bus refuses this user", "run as a user in the group bluetooth")
    if type(error).__name__ == "InvalidAddressError":
        return UnavailableError(
            "the address of the system bus makes no sense", "check DBUS_SYSTEM_BUS_ADDRESS"
        )
    text = str(error) or type(error).__name__
    return UnavailableError(f"{step}: {text}", "is bluetoothd running? " + _TRY_FAKE)


def _known() -> tuple[type[BaseException], ...]:
    """Everything that bleak lets through; dbus-fast exists on Linux only."""
    known: tuple[type[BaseException], ...] = (BleakError, OSError, TimeoutError, EOFError)
    try:
        from dbus_fast.errors import DBusFastError
    except ImportError:  # pragma: no cover - macOS, Windows
        return known
    return (*known, DBusFastError)


@asynccontextmanager
async def step(name: str, seconds: float) -> AsyncIterator[None]:
    """Bound a step of reaching a robot in time, and explain what it raises.

    Raises:
        SpheroProbeError: whatever went wrong, in words.
    """
    try:
        async with asyncio.timeout(seconds):
            yield
    except _known() as error:
        raise explain(error, name) from error
