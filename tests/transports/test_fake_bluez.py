"""The fake BlueZ is put to the test by bleak itself, unpatched, in this process and in another."""

import asyncio
import contextlib
import json
import os
import subprocess
import sys
from collections import deque
from collections.abc import AsyncIterator, Coroutine
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from bleak import BleakClient, BleakScanner
from bleak.backends.device import BLEDevice
from bleak.exc import (
    BleakBluetoothNotAvailableError,
    BleakBluetoothNotAvailableReason,
    BleakDBusError,
    BleakDeviceNotFoundError,
    BleakError,
    BleakGATTProtocolError,
)
from dbus_fast import Message, MessageType, Variant
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Response, Role
from sphero_probe.simulator import FakeRobot, parse_settings
from tests.support.fake_bluez import (
    ACCESS_DENIED,
    CHILD_EXITED,
    PHRASE,
    V2_API,
    V2_GATE,
    V2_SERVICE,
    Adapter,
    BusFaults,
    Characteristic,
    FakeBlueZ,
    Faults,
    Peripheral,
    Profile,
    Service,
    sphero_v1,
    sphero_v2,
)
from tests.support.fake_bluez_air import V1_ANSWERS, V1_COMMANDS, V1_GATE, V1_TX_POWER, V1_WAKE
from tests.support.fake_bluez_wire import SERVICE_ADDRESS, Bus, MatchRule, frame_length, to_bytes

ADDRESS = "AA:BB:CC:DD:EE:01"
OPEN = sphero_v2(gate=False)
CODEC = CODECS[Generation.V2]
REASONS = BleakBluetoothNotAvailableReason


class EchoRobot:
    """Says every write back, some seconds later."""

    def __init__(self, delay: float = 0.0) -> None:
        self.delay = delay
        self.due: deque[tuple[float, bytes]] = deque()

    def hear(self, data: bytes, *, now: float) -> None:
        self.due.append((now + self.delay, data))

    def speak(self, *, now: float) -> list[bytes]:
        said = []
        while self.due and self.due[0][0] <= now:
            said.append(self.due.popleft()[1])
        return said

    def next_time(self) -> float | None:
        return self.due[0][0] if self.due else None


class Heard:
    """What a client was notified of, and that its link fell."""

    def __init__(self) -> None:
        self.values: asyncio.Queue[bytes] = asyncio.Queue()
        self.fell = asyncio.Event()

    def on_value(self, _characteristic: object, value: bytearray) -> None:
        self.values.put_nowait(bytes(value))

    def on_fall(self, _client: BleakClient) -> None:
        self.fell.set()

    async def take(self, count: int) -> list[bytes]:
        return [await self.values.get() for _ in range(count)]


def echo(name: str | bytes | None = "BP-1234", **options: Any) -> Peripheral:
    everything: dict[str, Any] = {"robot": EchoRobot(), "services": OPEN} | options
    return Peripheral(name, ADDRESS, **everything)


def run(bluez: FakeBlueZ, work: Coroutine[Any, Any, Any], seconds: float = 20.0) -> Any:
    """Run one coroutine in a fresh event loop that reaches the fake."""

    async def hurry() -> Any:
        async with asyncio.timeout(seconds):
            return await work

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bluez.address)
        patch.delenv("BLEAK_DBUS_AUTH_UID", raising=False)
        return asyncio.run(hurry())


async def find(**options: Any) -> BLEDevice:
    device = await BleakScanner.find_device_by_address(ADDRESS, **options)
    assert device is not None
    return device


@contextlib.asynccontextmanager
async def talking(uuid: str = V2_API) -> AsyncIterator[tuple[BleakClient, Heard]]:
    heard = Heard()
    async with BleakClient(await find(), disconnected_callback=heard.on_fall) as client:
        await client.start_notify(uuid, heard.on_value)
        yield client, heard


# Scanning


def test_scan_finds_robots_with_name_address_and_strength() -> None:
    async def scan() -> dict[str, tuple[str | None, str | None, int, list[str]]]:
        found = {}
        async with BleakScanner() as scanner:
            async for device, heard in scanner.advertisement_data():
                found[device.address] = device.name, heard.local_name, heard.rssi, heard.service_uuids
                if len(found) == 2:
                    return found
        raise AssertionError

    robots = [
        Peripheral("BP-1234", "AA:BB:CC:DD:EE:01", rssi=-42, uuids=(V2_SERVICE,)),
        Peripheral("SB-5678", "aa:bb:cc:dd:ee:02", rssi=-70),
    ]
    with FakeBlueZ(robots) as bluez:
        assert run(bluez, scan()) == {
            "AA:BB:CC:DD:EE:01": ("BP-1234", "BP-1234", -42, [V2_SERVICE]),
            "AA:BB:CC:DD:EE:02": ("SB-5678", "SB-5678", -70, []),
        }
        assert len(bluez.called("StartDiscovery")) == len(bluez.called("StopDiscovery")) == 1


@pytest.mark.parametrize(
    ("name", "seen"),
    [
        pytest.param("Зоя-1", "Зоя-1", id="beyond ASCII"),
        pytest.param("BP\x1b[31m", "BP\x1b[31m", id="terminal escape passes"),
        pytest.param(b"BP-\xff99", "BP-", id="ends at bad UTF-8"),
        pytest.param(b"BP-1\0tail", "BP-1", id="ends at NUL"),
        pytest.param("  BP-1 \n", "BP-1", id="trimmed"),
        pytest.param(b"\xff", None, id="nothing left"),
        pytest.param(None, None, id="none"),
    ],
)
def test_names_as_bluez_passes_them_on(name: str | bytes | None, seen: str | None) -> None:
    with FakeBlueZ([echo(name)]) as bluez:
        device = run(bluez, find())
    assert device.name == seen


def test_scan_by_service_hears_only_those_that_advertise_it() -> None:
    other = Peripheral("SB-1", "AA:BB:CC:DD:EE:02", uuids=(V2_SERVICE,))

    async def scan() -> str:
        async with BleakScanner(service_uuids=[V2_SERVICE]) as scanner:
            async for device, _ in scanner.advertisement_data():
                return device.address
        raise AssertionError

    with FakeBlueZ([echo(), other]) as bluez:
        assert run(bluez, scan()) == other.address


def test_robots_come_and_go() -> None:
    robot = echo()

    async def scan(bluez: FakeBlueZ) -> None:
        async with BleakScanner() as scanner:
            bluez.add(robot)
            async for device, _ in scanner.advertisement_data():
                assert device.address == ADDRESS
                break

    with FakeBlueZ() as bluez:
        run(bluez, scan(bluez))
        assert run(bluez, find()).name == "BP-1234"
        bluez.remove(robot)
        with pytest.raises(AssertionError):
            run(bluez, find(timeout=0.1))
        bluez.add(robot)
        assert run(bluez, find()).name == "BP-1234"


def test_a_connected_robot_does_not_advertise() -> None:
    async def work() -> None:
        async with talking():
            assert await BleakScanner.find_device_by_address(ADDRESS, timeout=0.1) is None

    with FakeBlueZ([echo()]) as bluez:
        run(bluez, work())
        assert run(bluez, find()).address == ADDRESS


def test_scan_chooses_its_adapter() -> None:
    with FakeBlueZ([echo()], adapters=(Adapter("hci0"), Adapter("hci1"))) as bluez:
        device = run(bluez, find(bluez={"adapter": "hci1"}))
        assert device.details["path"] == "/org/bluez/hci1/dev_AA_BB_CC_DD_EE_01"
        assert {call.path for call in bluez.called("StartDiscovery")} == {"/org/bluez/hci1"}


def test_adapter_loses_and_regains_power() -> None:
    async def work(bluez: FakeBlueZ) -> None:
        async with talking() as (_, heard):
            bluez.power(on=False)
            await heard.fell.wait()

    with FakeBlueZ([echo()]) as bluez:
        run(bluez, work(bluez))
        with pytest.raises(BleakBluetoothNotAvailableError):
            run(bluez, find())
        bluez.power(on=True)
        assert run(bluez, find()).address == ADDRESS


# A machine that is not right


@pytest.mark.parametrize(
    ("machine", "error", "arguments"),
    [
        pytest.param(
            {"adapters": ()},
            BleakBluetoothNotAvailableError,
            ("No Bluetooth adapters found.", REASONS.NO_BLUETOOTH),
            id="no adapter",
        ),
        pytest.param(
            {"adapters": (Adapter(powered=False),)},
            BleakBluetoothNotAvailableError,
            (
                "No powered Bluetooth adapters found. Turn on Bluetooth and try again.",
                REASONS.POWERED_OFF,
            ),
            id="powered off",
        ),
        pytest.param(
            {"adapters": (Adapter(roles=("peripheral",)),)},
            BleakBluetoothNotAvailableError,
            ("No Bluetooth adapters with BLE 'central' role found.", REASONS.NO_BLE_CENTRAL_ROLE),
            id="no central role",
        ),
        pytest.param(
            {"faults": BusFaults(rejects_authentication=True)},
            BleakBluetoothNotAvailableError,
            ("authentication failed: REJECTED: ['EXTERNAL']", REASONS.DENIED_BY_SYSTEM),
            id="authentication rejected",
        ),
        pytest.param(
            {"faults": BusFaults(absent=True)},
            BleakDBusError,
            (
                "org.freedesktop.DBus.Error.ServiceUnknown",
                "The name org.bluez was not provided by any .service files",
            ),
            id="no BlueZ",
        ),
        pytest.param(
            {"faults": BusFaults(errors={"*": ACCESS_DENIED})}, BleakDBusError, ACCESS_DENIED, id="policy"
        ),
        pytest.param(
            {"faults": BusFaults(errors={"GetManagedObjects": CHILD_EXITED})},
            BleakDBusError,
            CHILD_EXITED,
            id="BlueZ does not start",
        ),
        pytest.param(
            {"faults": BusFaults(errors={"StartDiscovery": ("org.bluez.Error.InProgress", "busy")})},
            BleakDBusError,
            ("org.bluez.Error.InProgress", "busy"),
            id="one method fails",
        ),
    ],
)
def test_what_bleak_raises_on_a_broken_machine(
    machine: dict[str, Any], error: type[BleakError], arguments: tuple[Any, ...]
) -> None:
    with FakeBlueZ([echo()], **machine) as bluez, pytest.raises(error) as raised:
        run(bluez, find())
    assert type(raised.value) is error
    assert raised.value.args == arguments


@pytest.mark.parametrize(
    "faults",
    [
        pytest.param(BusFaults(mute=True), id="from the first byte"),
        pytest.param(BusFaults(unanswered=frozenset({"*"})), id="BlueZ"),
        pytest.param(BusFaults(unanswered=frozenset({"StartDiscovery"})), id="one method"),
    ],
)
def test_a_bus_that_never_answers_hangs_bleak(faults: BusFaults) -> None:
    with FakeBlueZ([echo()], faults=faults) as bluez, pytest.raises(TimeoutError):
        run(bluez, find(timeout=5), seconds=0.2)


def test_unknown_adapter() -> None:
    with FakeBlueZ([echo()]) as bluez, pytest.raises(BleakError, match="adapter 'hci7' not found"):
        run(bluez, find(bluez={"adapter": "hci7"}))


def test_faults_of_the_machine_can_be_mended() -> None:
    with FakeBlueZ([echo()], faults=BusFaults(absent=True)) as bluez:
        with pytest.raises(BleakDBusError):
            run(bluez, find())
        bluez.faults.absent = False
        assert run(bluez, find()).address == ADDRESS


# Connecting


def test_connect_lists_services() -> None:
    async def work() -> dict[str, dict[str, tuple[Any, int]]]:
        async with BleakClient(await find()) as client:
            return {
                service.uuid: {
                    one.uuid: (one.properties, one.max_write_without_response_size)
                    for one in service.characteristics
                }
                for service in client.services
            }

    with FakeBlueZ([echo(services=sphero_v2(), mtu=247)]) as bluez:
        assert run(bluez, work()) == {
            V2_SERVICE: {V2_API: (["write-without-response", "write", "notify"], 244)},
            "00020001-574f-4f20-5370-6865726f2121": {V2_GATE: (["write-without-response", "write"], 244)},
        }


@pytest.mark.parametrize("response", [True, False])
def test_write_is_heard_and_answered(response: bool) -> None:
    robot = echo()

    async def work() -> list[bytes]:
        async with talking() as (client, heard):
            await client.write_gatt_char(V2_API, b"\x8d\x0a", response=response)
            await client.write_gatt_char(V2_API, b"\x13\xd8", response=response)
            return await heard.take(2)

    with FakeBlueZ([robot]) as bluez:
        assert run(bluez, work()) == [b"\x8d\x0a", b"\x13\xd8"]
    assert robot.written == [(V2_API, b"\x8d\x0a"), (V2_API, b"\x13\xd8")]


def test_a_robot_that_takes_its_time() -> None:
    async def work() -> list[bytes]:
        async with talking() as (client, heard):
            for number in range(5):
                await client.write_gatt_char(V2_API, bytes((number,)), response=False)
            return await heard.take(5)

    with FakeBlueZ([echo(robot=EchoRobot(delay=0.05))]) as bluez:
        assert run(bluez, work()) == [b"\0", b"\1", b"\2", b"\3", b"\4"]


def test_notifications_need_a_subscription() -> None:
    async def work() -> list[bytes]:
        async with talking() as (client, heard):
            await client.stop_notify(V2_API)
            await client.write_gatt_char(V2_API, b"unheard", response=True)
            await client.start_notify(V2_API, heard.on_value)
            await client.write_gatt_char(V2_API, b"heard", response=True)
            return await heard.take(1)

    with FakeBlueZ([echo()]) as bluez:
        assert run(bluez, work()) == [b"heard"]


def test_reading_and_what_a_table_forbids() -> None:
    version, knob = "00002a26-0000-1000-8000-00805f9b34fb", "00002a00-0000-1000-8000-00805f9b34fb"
    table = Service(
        "0000180a-0000-1000-8000-00805f9b34fb",
        (Characteristic(version, ("read",), b"1.5.0"), Characteristic(knob, ("write-without-response",))),
    )

    async def work() -> list[int]:
        async with BleakClient(await find()) as client:
            assert await client.read_gatt_char(version) == b"1.5.0"
            codes = []
            for attempt in (client.read_gatt_char(knob), client.write_gatt_char(knob, b"x", response=True)):
                with pytest.raises(BleakGATTProtocolError) as raised:
                    await attempt
                codes.append(int(raised.value.code))
            with pytest.raises(BleakDBusError, match="Failed to initiate write"):
                await client.write_gatt_char(knob, bytes(21), response=False)
            return codes

    with FakeBlueZ([echo(services=Profile((table,), knob, version, {}))]) as bluez:
        assert run(bluez, work()) == [2, 3]


def test_twenty_rounds_stay_clean() -> None:
    robot = echo()

    async def work() -> None:
        for number in range(20):
            async with talking() as (client, heard):
                for part in range(5):
                    await client.write_gatt_char(V2_API, bytes((number, part)), response=False)
                assert await heard.take(5) == [bytes((number, part)) for part in range(5)]
            assert heard.fell.is_set()
            assert heard.values.empty()

    with FakeBlueZ([robot]) as bluez:
        run(bluez, work())
        assert len(bluez.called("Connect")) == len(bluez.called("Disconnect")) == 20
    assert len(robot.written) == 100


def test_a_link_that_falls() -> None:
    robot = echo()

    async def work(bluez: FakeBlueZ) -> list[bytes]:
        async with talking() as (client, heard):
            bluez.drop(robot)
            await heard.fell.wait()
            assert not client.is_connected
            with pytest.raises(BleakError, match="Service Discovery has not been performed yet"):
                await client.write_gatt_char(V2_API, b"x", response=False)
        async with talking() as (client, heard):
            await client.write_gatt_char(V2_API, b"again", response=False)
            return await heard.take(1)

    with FakeBlueZ([robot]) as bluez:
        assert run(bluez, work(bluez)) == [b"again"]


def test_an_idle_link_falls_by_itself() -> None:
    async def work() -> bool:
        heard = Heard()
        async with BleakClient(await find(), disconnected_callback=heard.on_fall):
            return await heard.fell.wait()

    with FakeBlueZ([echo(faults=Faults(drop_when_idle=0.3))]) as bluez:
        assert run(bluez, work())


def test_a_link_falls_during_a_write() -> None:
    robot = echo(faults=Faults(drop_at_write=2))

    async def work() -> None:
        async with talking() as (client, heard):
            await client.write_gatt_char(V2_API, b"1", response=True)
            with pytest.raises(BleakDBusError) as raised:
                await client.write_gatt_char(V2_API, b"2", response=True)
            assert raised.value.args == ("org.bluez.Error.Failed", "Not connected")
            await heard.fell.wait()

    with FakeBlueZ([robot]) as bluez:
        run(bluez, work())
    assert robot.written == [(V2_API, b"1")]


def test_the_link_outlives_a_client_that_vanishes() -> None:
    async def work(bluez: FakeBlueZ) -> list[bytes]:
        async with talking() as (_, heard):
            bluez.hang_up()
            await heard.fell.wait()
        device = "/org/bluez/hci0/dev_AA_BB_CC_DD_EE_01"
        assert await BleakScanner.find_device_by_address(ADDRESS, timeout=0.1) is None
        async with BleakClient(BLEDevice(ADDRESS, None, {"path": device})) as client:
            await client.start_notify(V2_API, heard.on_value)
            await client.write_gatt_char(V2_API, b"x", response=False)
            return await heard.take(1)

    with FakeBlueZ([echo()]) as bluez:
        assert run(bluez, work(bluez)) == [b"x"]
        assert len(bluez.called("Connect")) == 1


def test_a_client_that_never_left_doubles_the_next_ones_notifications() -> None:
    robot = echo()

    async def work(bluez: FakeBlueZ) -> list[bytes]:
        async with talking() as (_, stale):
            bluez.drop(robot)
            await stale.fell.wait()
            async with talking() as (client, heard):
                await client.write_gatt_char(V2_API, b"x", response=False)
                await client.write_gatt_char(V2_API, b"y", response=False)
                return await heard.take(4)

    with FakeBlueZ([robot]) as bluez:
        assert run(bluez, work(bluez)) == [b"x", b"x", b"y", b"y"]


@pytest.mark.parametrize(
    ("faults", "error", "text"),
    [
        pytest.param(
            Faults(gone_after_scan=True), BleakError, "device 'dev_AA_BB_CC_DD_EE_01' not found", id="gone"
        ),
        pytest.param(
            Faults(gone_at_connect=True), BleakDeviceNotFoundError, "may have been removed", id="going"
        ),
        pytest.param(
            Faults(connect_errors=("br-connection-canceled",)),
            BleakDBusError,
            r"\[org.bluez.Error.Failed\] br-connection-canceled",
            id="refused",
        ),
        pytest.param(
            Faults(drops_in_discovery=1),
            BleakError,
            "failed to discover services, device disconnected",
            id="falls during discovery",
        ),
        pytest.param(Faults(never_resolves=True), TimeoutError, "^$", id="services never known"),
        pytest.param(Faults(connect_hangs=True), TimeoutError, "^$", id="hangs"),
    ],
)
def test_what_bleak_raises_when_it_cannot_connect(faults: Faults, error: type[Exception], text: str) -> None:
    async def work() -> None:
        async with BleakClient(await find(), timeout=0.3 if error is TimeoutError else 10):
            raise AssertionError

    with FakeBlueZ([echo(faults=faults)]) as bluez, pytest.raises(error, match=text) as raised:
        run(bluez, work())
    assert type(raised.value) is error


def test_connecting_works_after_failures() -> None:
    robot = echo(faults=Faults(connect_errors=("le-connection-abort-by-local",) * 2, drops_in_discovery=1))

    async def work() -> list[bytes]:
        with pytest.raises(BleakError, match="failed to discover services"):
            await BleakClient(await find()).connect()
        async with talking() as (client, heard):
            await client.write_gatt_char(V2_API, b"x", response=False)
            return await heard.take(1)

    with FakeBlueZ([robot]) as bluez:
        assert run(bluez, work()) == [b"x"]
    assert robot.counts.connects == 4


# What goes wrong while talking


@pytest.mark.parametrize(
    ("faults", "expected"),
    [
        pytest.param(Faults(), [b"one", b"two", b"end"], id="none"),
        pytest.param(Faults(lose_every=2), [b"one", b"end"], id="lost"),
        pytest.param(Faults(double_every=3), [b"one", b"two", b"end", b"end"], id="doubled"),
        pytest.param(Faults(split=1), [bytes((one,)) for one in b"onetwoend"], id="single bytes"),
    ],
)
def test_notifications_suffer(faults: Faults, expected: list[bytes]) -> None:
    async def work() -> list[bytes]:
        async with talking() as (client, heard):
            for said in (b"one", b"two", b"end"):
                await client.write_gatt_char(V2_API, said, response=False)
            return await heard.take(len(expected))

    with FakeBlueZ([echo(faults=faults)]) as bluez:
        assert run(bluez, work()) == expected


def test_notifications_never_exceed_the_mtu() -> None:
    async def work() -> list[bytes]:
        async with talking() as (client, heard):
            await client.write_gatt_char(V2_API, bytes(range(45)), response=True)
            return await heard.take(3)

    with FakeBlueZ([echo()]) as bluez:
        assert run(bluez, work()) == [bytes(range(20)), bytes(range(20, 40)), bytes(range(40, 45))]


@pytest.mark.parametrize("code", [0x03, 0x06, 0x08, 0x0D, 0x0E, 0x80])
def test_att_errors_reach_who_writes_with_response(code: int) -> None:
    robot = echo(faults=Faults(write_error=code))

    async def work() -> int:
        async with talking() as (client, heard):
            with pytest.raises(BleakGATTProtocolError) as raised:
                await client.write_gatt_char(V2_API, b"x", response=True)
            await client.write_gatt_char(V2_API, b"y", response=False)
            assert await heard.take(1) == [b"y"]
            return int(raised.value.code)

    with FakeBlueZ([robot]) as bluez:
        assert run(bluez, work()) == code
    assert robot.written == [(V2_API, b"y")]


def test_a_missing_characteristic() -> None:
    async def work() -> list[str]:
        async with BleakClient(await find()) as client:
            return [one.uuid for one in client.services.characteristics.values()]

    with FakeBlueZ([echo(services=sphero_v2(), faults=Faults(missing=frozenset({V2_API})))]) as bluez:
        assert run(bluez, work()) == [V2_GATE]


def test_the_built_in_robot_answers_through_it() -> None:
    robot = Peripheral(
        "BP-1234", ADDRESS, robot=FakeRobot(parse_settings("bolt-plus?split=7")), services=OPEN
    )
    ping = Command(0x10, 0x00, b"ping", target=0x11)

    async def work() -> Response:
        decoder = CODEC.decoder(Role.HOST)
        async with talking() as (client, heard):
            await client.write_gatt_char(V2_API, CODEC.encode_command(ping, 7), response=False)
            while True:
                for packet in decoder.feed(await heard.values.get()):
                    assert isinstance(packet, Response)
                    return packet

    with FakeBlueZ([robot]) as bluez:
        response = run(bluez, work())
    assert (response.seq, response.code, response.payload) == (7, 0, b"ping")


# The handshake


def test_nothing_is_heard_before_the_phrase_in_each_connection() -> None:
    robot = echo(services=sphero_v2())

    async def work() -> list[list[bytes]]:
        heard_in = []
        for _ in range(2):
            async with talking() as (client, heard):
                for uuid, data in ((V2_API, b"too early"), (V2_GATE, PHRASE), (V2_API, b"now")):
                    await client.write_gatt_char(uuid, data, response=True)
                heard_in.append(await heard.take(1))
        return heard_in

    with FakeBlueZ([robot]) as bluez:
        assert run(bluez, work()) == [[b"now"], [b"now"]]
    assert robot.written == [(V2_API, b"too early"), (V2_GATE, PHRASE), (V2_API, b"now")] * 2


def test_a_v1_robot_wants_three_phrases() -> None:
    phrases = {V1_GATE: b"011i3", V1_TX_POWER: b"\x07", V1_WAKE: b"\x01"}

    async def work() -> list[bytes]:
        async with talking(V1_ANSWERS) as (client, heard):
            for uuid, data in phrases.items():
                await client.write_gatt_char(V1_COMMANDS, b"too early", response=True)
                await client.write_gatt_char(uuid, data, response=True)
            await client.write_gatt_char(V1_COMMANDS, b"now", response=True)
            return await heard.take(1)

    with FakeBlueZ([echo(services=sphero_v1())]) as bluez:
        assert run(bluez, work()) == [b"now"]


@pytest.mark.parametrize("service_changed", [True, False])
def test_the_api_comes_to_light_after_the_handshake(service_changed: bool) -> None:
    profile = sphero_v2(reveals_api_after_handshake=True, service_changed=service_changed)

    async def work() -> list[bytes]:
        device = await find()
        async with BleakClient(device) as client:
            assert client.services.get_service(V2_SERVICE) is None
            await client.write_gatt_char(V2_GATE, PHRASE, response=True)
        async with talking() as (client, heard):
            await client.write_gatt_char(V2_GATE, PHRASE, response=True)
            await client.write_gatt_char(V2_API, b"x", response=True)
            return await heard.take(1)

    with FakeBlueZ([echo(services=profile)]) as bluez:
        assert run(bluez, work()) == [b"x"]


def test_services_that_change_are_told_at_once() -> None:
    async def work() -> None:
        async with BleakClient(await find()) as client:
            await client.write_gatt_char(V2_GATE, PHRASE, response=True)
            backend = client._backend
            while client.services.get_service(V2_SERVICE) is None:
                backend.services = None
                await backend._get_services()  # type: ignore[attr-defined]

    with FakeBlueZ([echo(services=sphero_v2(reveals_api_after_handshake=True))]) as bluez:
        run(bluez, work())


# From another process

SCRIPT = """
import asyncio, json
from bleak import BleakClient, BleakScanner

async def main():
    device = await BleakScanner.find_device_by_name("BP-1234")
    values = asyncio.Queue()
    async with BleakClient(device) as client:
        await client.start_notify(API, lambda _, value: values.put_nowait(value.hex()))
        await client.write_gatt_char(API, bytes.fromhex("8d0a131007cbd8"), response=False)
        print(json.dumps([device.address, await values.get()]))

async def in_time():
    async with asyncio.timeout(20):
        await main()

asyncio.run(in_time())
"""


def test_another_process_reaches_the_robot() -> None:
    robot = echo()
    with FakeBlueZ([robot]) as bluez:
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", f"API = {V2_API!r}\n{SCRIPT}"],
            env=os.environ | {"DBUS_SYSTEM_BUS_ADDRESS": bluez.address},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    assert (done.returncode, json.loads(done.stdout or "null")) == (0, [ADDRESS, "8d0a131007cbd8"]), (
        done.stderr
    )
    assert robot.written == [(V2_API, bytes.fromhex("8d0a131007cbd8"))]


# The fake itself


def test_it_leaves_nothing_behind() -> None:
    with FakeBlueZ([echo()]) as bluez:
        run(bluez, find())
        path = Path(bluez.address.removeprefix("unix:path="))
        assert path.is_socket()
    assert not path.parent.exists()
    assert not bluez._thread.is_alive()
    with pytest.raises(FileNotFoundError):
        run(bluez, find())


def test_a_robot_that_raises_is_not_mistaken_for_a_silent_one() -> None:
    class Clumsy(EchoRobot):
        def hear(self, data: bytes, *, now: float) -> None:
            raise ZeroDivisionError(data, now)

    async def work() -> None:
        async with talking() as (client, _):
            with pytest.raises(BleakDBusError, match="stumbled: ZeroDivisionError"):
                await client.write_gatt_char(V2_API, b"x", response=False)

    with (
        pytest.raises(ExceptionGroup, match="stumbled") as raised,
        FakeBlueZ([echo(robot=Clumsy())]) as bluez,
    ):
        run(bluez, work())
    assert raised.group_contains(ZeroDivisionError)


SIGNAL = Message.new_signal(
    "/org/bluez/hci0/dev_1", "org.freedesktop.DBus.Properties", "PropertiesChanged", "s", ["/org/bluez/hci0"]
)


@pytest.mark.parametrize(
    ("rule", "fits"),
    [
        pytest.param("", True, id="no condition"),
        pytest.param("type='signal',member='PropertiesChanged'", True, id="quoted"),
        pytest.param("type=signal,member=PropertiesChanged", True, id="bare"),
        pytest.param("type=method_call", False, id="other type"),
        pytest.param("member=InterfacesAdded", False, id="other member"),
        pytest.param("path=/org/bluez/hci0/dev_1", True, id="path"),
        pytest.param("path=/org/bluez", False, id="path is exact"),
        pytest.param("path_namespace=/org/bluez", True, id="namespace"),
        pytest.param("path_namespace=/org/blue", False, id="namespace ends at a slash"),
        pytest.param("path_namespace=/", True, id="everything"),
        pytest.param("arg0path=/org/bluez/", True, id="argument below"),
        pytest.param("arg0path=/org/bluez", False, id="argument path without slash"),
        pytest.param("arg0=/org/bluez/hci0", True, id="argument"),
        pytest.param("arg1=x", False, id="no such argument"),
        pytest.param("sender=org.bluez", True, id="sender by name"),
        pytest.param("sender=org.freedesktop.DBus", False, id="other sender"),
    ],
)
def test_match_rules(rule: str, fits: bool) -> None:
    assert MatchRule.parse(rule).fits(SIGNAL, ("org.bluez", SERVICE_ADDRESS)) is fits


class Line:
    """A transport that keeps what is written to it."""

    def __init__(self) -> None:
        self.written = bytearray()

    def write(self, data: bytes) -> None:
        self.written += data


@settings(deadline=None)
@given(
    cuts=st.lists(st.integers(0, 400)),
    name=st.text(st.characters(codec="utf-8", exclude_characters="\0")),
)
def test_calls_arrive_whole_however_they_are_cut(cuts: list[int], name: str) -> None:
    calls: list[list[Any]] = []

    def serve(_client: object, call: Message) -> None:
        calls.append(call.body)

    client = Bus("org.bluez", serve, lambda _: None, BusFaults()).welcome()
    client._transport = Line()  # type: ignore[assignment]
    call = Message("org.bluez", "/", "a.b", "C", signature="sa{sv}", body=[name, {"x": Variant("ay", b"yz")}])
    stream = b"\0AUTH EXTERNAL 30\r\nNEGOTIATE_UNIX_FD\r\nBEGIN\r\n" + to_bytes(call, ":1.9", 7) * 3
    places = sorted({0, *(cut for cut in cuts if cut < len(stream)), len(stream)})
    for start, end in pairwise(places):
        client.data_received(stream[start:end])
    assert calls == [call.body] * 3
    assert client._transport.written.splitlines()[1] == b"AGREE_UNIX_FD"  # type: ignore[attr-defined]


def test_a_message_carries_its_sender_and_length() -> None:
    data = to_bytes(SIGNAL, ":1.0", 5)
    assert frame_length(data) == len(data)
    assert b":1.0\0" in data
    assert data[1] == MessageType.SIGNAL.value
