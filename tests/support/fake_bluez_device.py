"""The D-Bus objects and properties by which BlueZ shows a robot."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from dbus_fast import Message, Variant

from tests.support.fake_bluez_air import Characteristic, Peripheral
from tests.support.fake_bluez_objects import BlueZError, Properties

if TYPE_CHECKING:
    import asyncio

    from tests.support.fake_bluez_wire import Client

ROOT = "/org/bluez"
ADAPTER = "org.bluez.Adapter1"
DEVICE = "org.bluez.Device1"
SERVICE = "org.bluez.GattService1"
CHARACTERISTIC = "org.bluez.GattCharacteristic1"
DESCRIPTOR = "org.bluez.GattDescriptor1"
CLIENT_CONFIGURATION = "00002902-0000-1000-8000-00805f9b34fb"
FIRST_HANDLE = 0x000A


class Adapter(NamedTuple):
    """One Bluetooth adapter.

    Attributes:
        name: ``hci0``.
        powered: on.
        roles: ``central`` is what a scan needs.
        address: its own.
    """

    name: str = "hci0"
    powered: bool = True
    roles: tuple[str, ...] = ("central", "peripheral")
    address: str = "00:1A:7D:DA:71:13"

    @property
    def path(self) -> str:
        """The path of its object."""
        return f"{ROOT}/{self.name}"

    def properties(self) -> Properties:
        """Return its properties in BlueZ."""
        return {
            "Address": Variant("s", self.address),
            "AddressType": Variant("s", "public"),
            "Name": Variant("s", "fake"),
            "Alias": Variant("s", "fake"),
            "Class": Variant("u", 0),
            "Powered": Variant("b", self.powered),
            "Discoverable": Variant("b", False),
            "Pairable": Variant("b", False),
            "Discovering": Variant("b", False),
            "UUIDs": Variant("as", []),
            "Roles": Variant("as", list(self.roles)),
        }


class Device:
    """A peripheral as one adapter knows it.

    Attributes:
        path: of its object.
        adapter: the path of the adapter.
        peripheral: the robot.
        connected: whether there is a link.
        subscribers: characteristic path -> the D-Bus clients that want its notifications.
        connecting: a call of Connect that waits for its reply.
        timers: later events of this connection: the robot's next notification, the drop of the link.
        characteristics: every characteristic by its path, hidden and missing ones too.
        speaks: the path of the characteristic that the robot notifies on, empty where it has none.
    """

    def __init__(self, adapter: str, peripheral: Peripheral) -> None:
        self.path = f"{adapter}/dev_{peripheral.address.upper().replace(':', '_')}"
        self.adapter = adapter
        self.peripheral = peripheral
        self.connected = False
        self.subscribers: dict[str, list[Client]] = {}
        self.connecting: tuple[Client, Message] | None = None
        self.timers: dict[str, asyncio.TimerHandle] = {}
        self._services = list(self._number())
        self.characteristics = {path: one for _, _, below in self._services for path, one in below}
        speaker = peripheral.services.speaks
        self.speaks = next((path for path, one in self.characteristics.items() if one.uuid == speaker), "")

    def properties(self) -> Properties:
        """Return the properties of a device that BlueZ has just discovered."""
        alias = self.peripheral.alias()
        address = self.peripheral.address.upper()
        shown = {
            "Address": Variant("s", address),
            "AddressType": Variant("s", "random"),
            "Alias": Variant("s", alias or address.replace(":", "-")),
            "Adapter": Variant("o", self.adapter),
            "Paired": Variant("b", False),
            "Bonded": Variant("b", False),
            "Trusted": Variant("b", False),
            "Blocked": Variant("b", False),
            "LegacyPairing": Variant("b", False),
            "Connected": Variant("b", False),
            "ServicesResolved": Variant("b", False),
            "UUIDs": Variant("as", list(self.peripheral.uuids)),
            "RSSI": Variant("n", self.peripheral.rssi),
        }
        return shown | ({"Name": Variant("s", alias)} if alias else {})

    def all_uuids(self) -> list[str]:
        """Return the services that it advertises and those that were discovered."""
        found = [one.uuid for one in self.peripheral.services.services if self.peripheral.shows(one.uuid)]
        return list(dict.fromkeys([*self.peripheral.uuids, *found]))

    def table(self) -> Iterator[tuple[str, str, Properties]]:
        """Return the objects of its services, parents first: path, interface, properties.

        Handles count hidden and missing ones too, so that an object keeps its path when others appear.
        """
        for path, uuid, characteristics in self._services:
            if not self.peripheral.shows(uuid):
                continue
            yield (
                path,
                SERVICE,
                {
                    "UUID": Variant("s", uuid),
                    "Primary": Variant("b", True),
                    "Device": Variant("o", self.path),
                    "Includes": Variant("ao", []),
                },
            )
            for below, one in characteristics:
                if self.peripheral.shows(one.uuid):
                    yield from self._characteristic(path, below, one)

    def _number(self) -> Iterator[tuple[str, str, list[tuple[str, Characteristic]]]]:
        handle = FIRST_HANDLE
        for service in self.peripheral.services.services:
            path = f"{self.path}/service{handle:04x}"
            below = [
                (f"{path}/char{handle + 1 + 3 * number:04x}", one)
                for number, one in enumerate(service.characteristics)
            ]
            handle += 1 + 3 * len(below)
            yield path, service.uuid, below

    def _characteristic(
        self, service: str, path: str, one: Characteristic
    ) -> Iterator[tuple[str, str, Properties]]:
        shown = {
            "UUID": Variant("s", one.uuid),
            "Service": Variant("o", service),
            "Flags": Variant("as", list(one.flags)),
            "MTU": Variant("q", self.peripheral.mtu),
        }
        if "notify" not in one.flags:
            yield path, CHARACTERISTIC, shown
            return
        yield path, CHARACTERISTIC, shown | {"Notifying": Variant("b", False)}
        descriptor = {
            "UUID": Variant("s", CLIENT_CONFIGURATION),
            "Characteristic": Variant("o", path),
        }
        yield f"{path}/desc{int(path[-4:], 16) + 2:04x}", DESCRIPTOR, descriptor


def att_error(code: int) -> BlueZError:
    """Return the BlueZ error for an ATT error code."""
    match code:
        case 0x02:
            return BlueZError("NotPermitted", "Read not permitted")
        case 0x03:
            return BlueZError("NotPermitted", "Write not permitted")
        case 0x05 | 0x0C | 0x0F:
            return BlueZError("NotPermitted", "Not paired")
        case 0x06:
            return BlueZError("NotSupported", "Operation is not supported")
        case 0x07:
            return BlueZError("InvalidArguments", "Invalid offset")
        case 0x08:
            return BlueZError("NotAuthorized", "Operation Not Authorized")
        case 0x0D:
            return BlueZError("InvalidArguments", "Invalid Length")
        case _:
            return BlueZError("Failed", f"Operation failed with ATT error: 0x{code:02x}")
