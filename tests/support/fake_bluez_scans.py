"""The adapters of the fake BlueZ and their scans."""

import asyncio
from collections.abc import Callable, Iterable

from dbus_fast import Message, Variant

from tests.support.fake_bluez_air import Peripheral
from tests.support.fake_bluez_device import ADAPTER, DEVICE, ROOT, Adapter, Device
from tests.support.fake_bluez_links import Links
from tests.support.fake_bluez_objects import BlueZError, Objects, returns
from tests.support.fake_bluez_wire import Client

ADVERTISING_SECONDS = 0.02
"""Seconds between two advertisements of a robot; real intervals are longer, and would slow the tests."""


class Scans:
    """Every adapter and the clients that scan with it.

    Attributes:
        methods: (interface, member) -> handler.
    """

    def __init__(self, objects: Objects, links: Links, adapters: Iterable[Adapter]) -> None:
        self.methods: dict[tuple[str, str], Callable[[Client, Message], Message | None]] = {
            (ADAPTER, "SetDiscoveryFilter"): self._set_filter,
            (ADAPTER, "StartDiscovery"): self._start,
            (ADAPTER, "StopDiscovery"): self._stop,
            (ADAPTER, "RemoveDevice"): self._remove_device,
        }
        self._objects = objects
        self._links = links
        self._scanners: dict[str, list[Client]] = {one.path: [] for one in adapters}
        self._wanted: dict[tuple[str, Client], frozenset[str]] = {}
        self._rounds: dict[str, asyncio.TimerHandle] = {}
        for one in adapters:
            objects.tree[one.path] = {ADAPTER: one.properties()}

    def add(self, peripheral: Peripheral) -> None:
        """Bring a robot into range of every adapter."""
        for adapter in self._scanners:
            self._links.add(adapter, peripheral)

    def power(self, name: str, *, on: bool) -> None:
        """Switch an adapter on or off."""
        adapter = f"{ROOT}/{name}"
        self._objects.change(adapter, ADAPTER, {"Powered": Variant("b", on)})
        if not on:
            for device in self._links.devices.values():
                if device.adapter == adapter:
                    self._links.fall(device)
            self._scanners[adapter].clear()
            self._end(adapter)

    def gone(self, client: Client) -> None:
        """End the scans of a D-Bus client that left."""
        for adapter, scanners in self._scanners.items():
            self._wanted.pop((adapter, client), None)
            if client in scanners:
                scanners.remove(client)
                self._end(adapter)

    def check_power(self, adapter: str) -> None:
        """Raise an error if the radio is off.

        Raises:
            BlueZError: the adapter is off.
        """
        if not self._objects.read(adapter, ADAPTER, "Powered"):
            raise BlueZError("NotReady", "Resource Not Ready")

    def _set_filter(self, client: Client, call: Message) -> Message:
        wanted = call.body[0].get("UUIDs")
        self._wanted[call.path or "", client] = frozenset(wanted.value if wanted else ())
        return returns(call)

    def _start(self, client: Client, call: Message) -> None:
        adapter = call.path or ""
        self.check_power(adapter)
        scanners = self._scanners[adapter]
        if client in scanners:
            raise BlueZError("InProgress", "Operation already in progress")
        scanners.append(client)
        self._objects.reply(client, call)
        self._objects.change(adapter, ADAPTER, {"Discovering": Variant("b", True)})
        self._advertise(adapter)

    def _stop(self, client: Client, call: Message) -> Message:
        adapter = call.path or ""
        self.check_power(adapter)
        if client not in self._scanners[adapter]:
            raise BlueZError("Failed", "No discovery started")
        self._scanners[adapter].remove(client)
        self._end(adapter)
        return returns(call)

    def _remove_device(self, _client: Client, call: Message) -> Message:
        device = self._links.devices.get(call.body[0])
        if device is None or device.path not in self._objects:
            raise BlueZError("DoesNotExist", "Does Not Exist")
        self._links.forget(device)
        return returns(call)

    def _advertise(self, adapter: str) -> None:
        """Advertise every robot that is not connected, repeatedly."""
        filters = [self._wanted.get((adapter, client), frozenset()) for client in self._scanners[adapter]]
        for device in self._links.devices.values():
            peripheral = device.peripheral
            gone = peripheral.faults.gone_after_drop and peripheral.counts.connects > 0
            connected = gone or any(other.connected for other in self._links.of(peripheral))
            wanted = any(not uuids or uuids & set(peripheral.uuids) for uuids in filters)
            if device.adapter != adapter or connected or not wanted:
                continue
            if peripheral.faults.asleep:
                self._remember(device)
                continue
            if device.path in self._objects:
                self._objects.change(device.path, DEVICE, {"RSSI": Variant("n", peripheral.rssi)})
            else:
                self._objects.show(device.path, DEVICE, device.properties())
        self._rest(adapter)
        loop = asyncio.get_running_loop()
        self._rounds[adapter] = loop.call_later(ADVERTISING_SECONDS, self._advertise, adapter)

    def _remember(self, device: Device) -> None:
        """Make BlueZ report a device that does not advertise, as it does when a property changes."""
        if device.path in self._objects:
            self._objects.change(device.path, DEVICE, {"Trusted": Variant("b", False)})
        else:
            self._links.know(device)

    def _end(self, adapter: str) -> None:
        """Stop advertising once no client scans any more."""
        if self._scanners[adapter]:
            return
        self._rest(adapter)
        self._objects.change(adapter, ADAPTER, {"Discovering": Variant("b", False)})
        for device in self._links.devices.values():
            if device.adapter == adapter:
                self._objects.change(device.path, DEVICE, {}, ("RSSI",))
                if device.peripheral.faults.gone_after_scan:
                    self._links.forget(device)

    def _rest(self, adapter: str) -> None:
        if adapter in self._rounds:
            self._rounds.pop(adapter).cancel()
