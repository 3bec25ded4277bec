"""What this machine has of Bluetooth: bus, adapters, connected devices, switches."""

import asyncio
import re
import shutil
from asyncio.subprocess import DEVNULL, PIPE
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from dbus_fast.aio import MessageBus

RFKILL: Final = Path("/sys/class/rfkill")
"""Where Linux shows the switches of its radios [kernel, sysfs-class-rfkill]."""

_BLUEZ: Final = "org.bluez"
_ADAPTER: Final = "org.bluez.Adapter1"
_DEVICE: Final = "org.bluez.Device1"
_VERSION: Final = re.compile(rb"\d+\.\d+")
CLOSING: Final = 1.0
"""Seconds that a bus gets to close its connection."""


class Adapter(NamedTuple):
    """One Bluetooth adapter, as BlueZ shows it.

    Attributes:
        name: ``hci0``.
        address: its own.
        powered: it is on.
        central: it can scan and connect over Bluetooth LE.
    """

    name: str
    address: str
    powered: bool
    central: bool


class Peer(NamedTuple):
    """A device that is connected to this machine.

    Attributes:
        name: as BlueZ calls it; a stranger's text.
        address: its own.
    """

    name: str
    address: str


class Sight(NamedTuple):
    """What BlueZ shows of this machine.

    Attributes:
        adapters: by name.
        connected: the devices that are connected to it, by whichever program.
    """

    adapters: list[Adapter]
    connected: list[Peer]


class Switch(NamedTuple):
    """The switch of a Bluetooth radio.

    Attributes:
        name: ``rfkill0``.
        soft: it is blocked by software.
        hard: it is blocked by a switch or key of the machine.
    """

    name: str
    soft: bool
    hard: bool


async def reach_bus(timeout: float) -> None:
    """Connect to the system bus, and leave it; Linux only.

    Args:
        timeout: seconds.

    Raises:
        TimeoutError: it does not answer in time.
        OSError: there is none, or it may not be used.
        EOFError: it hangs up.
        BleakBluetoothNotAvailableError: it lets this user not in.
        DBusFastError: its address makes no sense, or what it says.
    """
    async with asyncio.timeout(timeout), _system_bus():
        return


async def adapters(timeout: float) -> list[Adapter]:
    """Return the Bluetooth adapters that BlueZ has, by name; Linux only.

    Args:
        timeout: seconds for the whole look.

    Raises:
        BleakDBusError: BlueZ is not there, or refuses.
        Exception: what ``reach_bus`` raises, too.
    """
    return (await look(timeout)).adapters


async def look(timeout: float) -> Sight:
    """Return the adapters and connected devices that BlueZ knows; Linux only.

    Args:
        timeout: seconds for the whole look.

    Raises:
        BleakDBusError: BlueZ is not there, or refuses.
        Exception: what ``reach_bus`` raises, too.
    """
    from bleak.backends.bluezdbus.utils import assert_reply
    from dbus_fast import Message, unpack_variants

    ask = Message(
        destination=_BLUEZ,
        path="/",
        interface="org.freedesktop.DBus.ObjectManager",
        member="GetManagedObjects",
    )
    async with asyncio.timeout(timeout), _system_bus() as bus:
        reply = await bus.call(ask)
        if reply is None:
            raise EOFError("the system bus hung up")
        assert_reply(reply)
        return _sight(unpack_variants(reply.body[0]))


async def bluez_version(timeout: float) -> str:
    """Return the version of the BlueZ tools as ``5.66``, empty where it is not known.

    Args:
        timeout: seconds until the question is given up.
    """
    program = shutil.which("bluetoothctl")
    if program is None:
        return ""
    said = b""
    with suppress(OSError, TimeoutError):  # a time-out of asyncio's is one of the latter
        asked = await asyncio.create_subprocess_exec(
            program, "--version", stdin=DEVNULL, stdout=PIPE, stderr=DEVNULL
        )
        try:
            async with asyncio.timeout(timeout):
                said, _ = await asked.communicate()
        finally:
            if asked.returncode is None:
                with suppress(ProcessLookupError):
                    asked.kill()
                await asked.wait()
    found = _VERSION.search(said)
    return found[0].decode() if found else ""


def switches(folder: Path | None = None) -> list[Switch]:
    """Return the switches of the Bluetooth radios; none where the system shows none.

    Args:
        folder: where they are shown, None for the kernel's usual place.
    """
    found = []
    with suppress(OSError):
        for radio in sorted((folder or RFKILL).iterdir()):
            with suppress(OSError):
                if _word(radio / "type") == "bluetooth":
                    found.append(
                        Switch(radio.name, _word(radio / "soft") == "1", _word(radio / "hard") == "1")
                    )
    return found


def _word(file: Path) -> str:
    return file.read_text(encoding="ascii", errors="replace").strip()


@asynccontextmanager
async def _system_bus() -> "AsyncIterator[MessageBus]":
    """Connect to the bus in the very way that bleak does; the connection is closed on leaving."""
    from bleak.backends.bluezdbus.utils import get_dbus_authenticator
    from bleak.exc import BleakBluetoothNotAvailableError, BleakBluetoothNotAvailableReason
    from dbus_fast import AuthError, BusType
    from dbus_fast.aio import MessageBus

    bus = MessageBus(bus_type=BusType.SYSTEM, auth=get_dbus_authenticator())
    try:
        try:
            await bus.connect()
        except AuthError as error:
            denied = BleakBluetoothNotAvailableReason.DENIED_BY_SYSTEM
            raise BleakBluetoothNotAvailableError(str(error), denied) from error
        yield bus
    finally:
        stood = bus.connected
        bus.disconnect()
        if stood:  # one that never stood does not tell when it is gone
            with suppress(OSError, EOFError, TimeoutError):
                async with asyncio.timeout(CLOSING):
                    await bus.wait_for_disconnect()  # type: ignore[no-untyped-call]


def _sight(objects: dict[str, dict[str, dict[str, Any]]]) -> Sight:
    adapters, connected = [], []
    for path, interfaces in sorted(objects.items()):
        if adapter := interfaces.get(_ADAPTER):
            adapters.append(
                Adapter(
                    path.rpartition("/")[2],
                    str(adapter.get("Address", "")),
                    adapter.get("Powered") is True,
                    "central" in adapter.get("Roles", ()),
                )
            )
        device = interfaces.get(_DEVICE, {})
        if device.get("Connected") is True:
            address = str(device.get("Address", ""))
            connected.append(Peer(str(device.get("Alias", address)), address))
    return Sight(adapters, connected)
