"""The connections of the fake BlueZ: implements the methods of devices and characteristics.

Details that matter to a client follow bluetoothd 5.8x: services stay known after a disconnection, a
D-Bus client that subscribed and never left is notified again after the next connection, and each subscriber
costs one signal.
"""

import asyncio
from collections.abc import Callable

from dbus_fast import Message, Variant

from tests.support.fake_bluez_air import ATT_HEADER, Characteristic, Peripheral
from tests.support.fake_bluez_device import CHARACTERISTIC, DEVICE, Device, att_error
from tests.support.fake_bluez_objects import BlueZError, Objects, returns
from tests.support.fake_bluez_wire import Client, unknown_method

ABORTED = "le-connection-abort-by-local"
DISCOVERY_SECONDS = 0.01
"""Seconds until a connection that drops during discovery drops."""
SOON = 0.0005
"""The shortest wait for a robot, so that a robot that is due but silent does not keep the loop busy."""
LONGEST_VALUE = 512


class Links:
    """Every device and its connection.

    Attributes:
        objects: what clients see.
        devices: path -> a peripheral as one adapter knows it, discovered or not.
        most_at_once: adapter -> the most links that it had at a time.
        methods: (interface, member) -> handler; it returns None if the reply was sent already or is sent
            later.
    """

    def __init__(self, objects: Objects) -> None:
        self.objects = objects
        self.devices: dict[str, Device] = {}
        self.most_at_once: dict[str, int] = {}
        self.methods: dict[tuple[str, str], Callable[[Client, Message], Message | None]] = {
            (DEVICE, "Connect"): self._connect,
            (DEVICE, "Disconnect"): self._disconnect,
            (DEVICE, "Pair"): self._pair,
            (CHARACTERISTIC, "ReadValue"): self._read,
            (CHARACTERISTIC, "WriteValue"): self._write,
            (CHARACTERISTIC, "StartNotify"): self._start_notify,
            (CHARACTERISTIC, "StopNotify"): self._stop_notify,
            (CHARACTERISTIC, "AcquireWrite"): self._not_supported,
            (CHARACTERISTIC, "AcquireNotify"): self._not_supported,
        }
        self._characteristics: dict[str, tuple[Device, Characteristic]] = {}

    def add(self, adapter: str, peripheral: Peripheral) -> None:
        """Bring a robot into range of an adapter."""
        device = Device(adapter, peripheral)
        self.devices[device.path] = device
        for path, one in device.characteristics.items():
            self._characteristics[path] = device, one

    def remove(self, peripheral: Peripheral) -> None:
        """Remove a robot permanently."""
        for device in self.of(peripheral):
            self.forget(device)
            del self.devices[device.path]

    def drop(self, peripheral: Peripheral) -> None:
        """Drop every link to a robot."""
        for device in self.of(peripheral):
            self.fall(device)

    def of(self, peripheral: Peripheral) -> list[Device]:
        """Return what the adapters know of a robot."""
        return [device for device in self.devices.values() if device.peripheral is peripheral]

    def know(self, device: Device) -> None:
        """Make BlueZ know a device from an earlier scan."""
        known = device.properties()
        del known["RSSI"]
        self.objects.show(device.path, DEVICE, known)

    def hold(self, device: Device) -> None:
        """Make another program on this machine connect to a robot, and stay connected."""
        if device.path not in self.objects:
            self.know(device)
        self._link(device)
        self._tell_connected(device, up=True)
        self._discover(device)

    def forget(self, device: Device) -> None:
        """Remove a device from BlueZ; it can be discovered again."""
        self.fall(device)
        self.objects.hide(device.path)

    def fall(self, device: Device) -> None:
        """Drop a link, if there is one."""
        if device.connected:
            self._go_down(device)
            self._tell_connected(device, up=False)
            if device.peripheral.faults.gone_after_drop:
                self.objects.hide(device.path)

    def gone(self, client: Client) -> None:
        """End the pending calls of a D-Bus client that left; its links stay up, as they do in BlueZ."""
        for device in self.devices.values():
            for path in list(device.subscribers):
                self._unsubscribe(device, path, client)
            if device.connecting and device.connecting[0] is client:
                device.connecting = None

    # Coming and going

    def _connect(self, client: Client, call: Message) -> None:
        device = self.devices[call.path or ""]
        peripheral = device.peripheral
        faults = peripheral.faults
        if faults.gone_at_connect:
            peripheral.counts.connects += 1
            self.forget(device)
            raise unknown_method(call, "Object")
        if device.connected:
            self.objects.reply(client, call)
            return
        if device.connecting:
            raise BlueZError("InProgress", "In Progress")
        number = peripheral.counts.connects
        peripheral.counts.connects += 1
        if number < len(faults.connect_errors):
            self._fail_to_connect(device, faults.connect_errors[number])
        if 0 < faults.most_connections <= peripheral.counts.connected:
            raise BlueZError("Failed", "Software caused connection abort")
        if faults.connect_hangs or any(other.connected for other in self.of(peripheral)):
            device.connecting = client, call
            return
        self._link(device)
        self._tell_connected(device, up=True)
        self.objects.reply(client, call)
        self._discover(device)

    def _link(self, device: Device) -> None:
        device.connected = True
        device.peripheral.start_connection()
        links = sum(one.connected for one in self.devices.values() if one.adapter == device.adapter)
        self.most_at_once[device.adapter] = max(links, self.most_at_once.get(device.adapter, 0))

    def _fail_to_connect(self, device: Device, text: str) -> None:
        if text == ABORTED:
            self._tell_connected(device, up=True)
            asyncio.get_running_loop().call_soon(lambda: self._tell_connected(device, up=False))
        raise BlueZError("Failed", text)

    def _discover(self, device: Device) -> None:
        faults = device.peripheral.faults
        if device.peripheral.counts.connected <= faults.drops_in_discovery:
            self._later(device, "discovery", DISCOVERY_SECONDS, self.fall)
        elif not faults.never_resolves:
            self._show_services(device)
            self.objects.change(device.path, DEVICE, {"ServicesResolved": Variant("b", True)})
            self._expect_idling(device)
            self._listen(device)

    def _show_services(self, device: Device) -> None:
        """Update the objects below a device to match its table."""
        table = {path: (interface, shown) for path, interface, shown in device.table()}
        for path in [one for one in self.objects.tree if one.startswith(f"{device.path}/service")]:
            if path not in table and path in self.objects:
                self.objects.hide(path)
        for path, (interface, shown) in table.items():
            if path not in self.objects:
                self.objects.show(path, interface, shown)
        uuids = device.all_uuids()
        if uuids != self.objects.read(device.path, DEVICE, "UUIDs"):
            self.objects.change(device.path, DEVICE, {"UUIDs": Variant("as", uuids)})

    def _disconnect(self, client: Client, call: Message) -> None:
        device = self.devices[call.path or ""]
        if device.connecting:
            waiting, connect = device.connecting
            device.connecting = None
            error = "org.bluez.Error.Failed", "br-connection-canceled"
            self.objects.bus.reply(waiting, connect, Message.new_error(connect, *error))
        stood = device.connected
        self._go_down(device)
        self.objects.reply(client, call)
        if stood:
            self._tell_connected(device, up=False)

    def _pair(self, _client: Client, call: Message) -> Message:
        self.objects.change(call.path or "", DEVICE, {"Paired": Variant("b", True)})
        return returns(call)

    def _go_down(self, device: Device) -> None:
        device.connected = False
        for timer in device.timers.values():
            timer.cancel()
        device.timers.clear()
        if device.path in self.objects and self.objects.read(device.path, DEVICE, "ServicesResolved"):
            self.objects.change(device.path, DEVICE, {"ServicesResolved": Variant("b", False)})

    def _tell_connected(self, device: Device, *, up: bool) -> None:
        self.objects.change(device.path, DEVICE, {"Connected": Variant("b", up)})

    # Characteristics

    def _reach(self, call: Message) -> tuple[Device, Characteristic]:
        device, one = self._characteristics[call.path or ""]
        if not device.connected:
            raise BlueZError("Failed", "Not connected")
        return device, one

    def _read(self, _client: Client, call: Message) -> Message:
        _, one = self._reach(call)
        if "read" not in one.flags:
            raise att_error(0x02)
        self.objects.change(call.path or "", CHARACTERISTIC, {"Value": Variant("ay", one.value)})
        return returns(call, "ay", one.value)

    def _write(self, client: Client, call: Message) -> None:
        device, one = self._reach(call)
        peripheral, faults = device.peripheral, device.peripheral.faults
        data, options = bytes(call.body[0]), call.body[1]
        with_response = "type" in options and options["type"].value == "request"
        peripheral.counts.writes += 1
        if peripheral.counts.writes == faults.drop_at_write:
            self.fall(device)
            raise BlueZError("Failed", "Not connected")
        if with_response and faults.write_error is not None:
            raise att_error(faults.write_error)
        if with_response and "write" not in one.flags:
            raise att_error(0x03)
        if with_response and len(data) > LONGEST_VALUE:
            raise att_error(0x0D)
        if not with_response and len(data) > peripheral.mtu - ATT_HEADER:
            raise BlueZError("Failed", "Failed to initiate write")
        came_to_light = False
        if with_response or "write-without-response" in one.flags:
            came_to_light = peripheral.receive(one.uuid, data, now=asyncio.get_running_loop().time())
        self.objects.reply(client, call)
        if came_to_light and peripheral.services.service_changed:
            self._show_services(device)
        self._expect_idling(device)
        self._listen(device)

    def _start_notify(self, client: Client, call: Message) -> Message:
        path = call.path or ""
        device, one = self._characteristics[path]
        if "notify" not in one.flags:
            raise BlueZError("NotSupported", "Operation is not supported")
        subscribers = device.subscribers.setdefault(path, [])
        if client not in subscribers:
            subscribers.append(client)
        if device.connected and not self.objects.read(path, CHARACTERISTIC, "Notifying"):
            self.objects.change(path, CHARACTERISTIC, {"Notifying": Variant("b", True)})
        return returns(call)

    def _stop_notify(self, client: Client, call: Message) -> Message:
        device, _ = self._characteristics[call.path or ""]
        if not self._unsubscribe(device, call.path or "", client):
            raise BlueZError("Failed", "No notify session started")
        return returns(call)

    def _unsubscribe(self, device: Device, path: str, client: Client) -> bool:
        subscribers = device.subscribers.get(path, [])
        if client not in subscribers:
            return False
        subscribers.remove(client)
        if not subscribers:
            self.objects.change(path, CHARACTERISTIC, {"Notifying": Variant("b", False)})
        return True

    def _not_supported(self, _client: Client, _call: Message) -> Message:
        raise BlueZError("NotSupported", "Operation is not supported")

    # The robot's side

    def _listen(self, device: Device) -> None:
        """Deliver the robot's notifications that are due, and schedule the next call."""
        robot = device.peripheral.robot
        if robot is None or not device.connected:
            return
        now = asyncio.get_running_loop().time()
        path = device.speaks
        for value in device.peripheral.notifications(now=now):
            for _ in device.subscribers.get(path, ()):
                self.objects.change(path, CHARACTERISTIC, {"Value": Variant("ay", value)})
        due = robot.next_time()
        if due is not None:
            self._later(device, "robot", max(due - now, SOON), self._listen)

    def _expect_idling(self, device: Device) -> None:
        seconds = device.peripheral.faults.drop_when_idle
        if seconds is not None:
            self._later(device, "idle", seconds, self.fall)

    def _later(self, device: Device, what: str, seconds: float, action: Callable[[Device], None]) -> None:
        if what in device.timers:
            device.timers[what].cancel()
        device.timers[what] = asyncio.get_running_loop().call_later(seconds, action, device)
