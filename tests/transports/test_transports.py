"""What every transport promises, for all that need no hardware; and addresses."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager

import pytest

from sphero_probe.errors import LinkLostError, UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import DeviceAddress, open_transport, parse_address
from tests.support.connections import hear
from tests.support.fake_bluez import FakeBlueZ, Faults, Peripheral, sphero_v2

CODEC = CODECS[Generation.V2]
PATIENCE = 30
ADDRESS = "AA:BB:CC:DD:EE:01"
pytestmark = pytest.mark.usefixtures("limited")


@asynccontextmanager
async def fake(settings: str) -> AsyncIterator[Connection]:
    async with open_transport(parse_address(f"fake:{settings}")) as connection:
        yield connection


@asynccontextmanager
async def bluetooth(settings: str) -> AsyncIterator[Connection]:
    robot = FakeRobot(parse_settings(settings))
    peripheral = Peripheral(robot.name, ADDRESS, robot=robot, services=sphero_v2(), mtu=23)
    with FakeBlueZ([peripheral]) as bluez, pytest.MonkeyPatch.context() as patch:
        patch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bluez.address)
        async with open_transport(DeviceAddress("ble", ADDRESS), OpenOptions(timeout=5)) as connection:
            yield connection


Opened = Callable[[str], AbstractAsyncContextManager[Connection]]
TRANSPORTS = [pytest.param(fake, id="fake"), pytest.param(bluetooth, id="ble")]


@pytest.mark.parametrize("opened", TRANSPORTS)
@pytest.mark.parametrize(
    "payload", [b"", b"\x8d\xd8\xab", bytes(range(16))], ids=["empty", "escapes", "longest"]
)
def test_what_is_written_is_answered(opened: Opened, payload: bytes) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opened("bolt?split=3") as connection:
            assert connection.robot
            assert connection.robot.key == "bolt"
            assert connection.generation is Generation.V2
            assert connection.name.startswith("SB-")
            frame = CODEC.encode_command(Command(0x10, 0x00, payload, 0x11), 9)
            await connection.transport.write(frame)
            assert (await hear(connection, 9)).payload == payload

    asyncio.run(work())


@pytest.mark.parametrize("opened", TRANSPORTS)
def test_once_closed_reads_end_and_writes_fail(opened: Opened) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE):
            manager: AbstractAsyncContextManager[Connection] = opened("bolt")
            async with manager as connection:
                transport = connection.transport
            assert await transport.read() == b""
            with pytest.raises(LinkLostError):
                await transport.write(b"\x8d")

    asyncio.run(work())


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("fake:bolt-plus?seed=3", DeviceAddress("fake", "bolt-plus?seed=3")),
        ("BP-1234", DeviceAddress("ble", "BP-1234")),
        ("ble:BP-1234", DeviceAddress("ble", "BP-1234")),
        ("AA:BB:CC:DD:EE:FF", DeviceAddress("ble", "AA:BB:CC:DD:EE:FF")),
        ("aa:bb:cc:dd:ee:ff", DeviceAddress("ble", "aa:bb:cc:dd:ee:ff")),
        ("ble:AA:BB:CC:DD:EE:FF", DeviceAddress("ble", "AA:BB:CC:DD:EE:FF")),
        (
            "7C1A0E4B-6B0C-4F6E-9B33-000000000001",
            DeviceAddress("ble", "7C1A0E4B-6B0C-4F6E-9B33-000000000001"),
        ),
    ],
)
def test_addresses(text: str, address: DeviceAddress) -> None:
    assert parse_address(text) == address


def test_an_address_is_written_as_it_is_read() -> None:
    assert str(parse_address("fake:bolt")) == "fake:bolt"


@pytest.mark.parametrize(
    ("text", "said"),
    [("", "empty"), ("fake:", "names no robot"), ("fkae:bolt", "fkae"), ("tcp:x", "unknown kind")],
)
def test_addresses_that_make_no_sense(text: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        parse_address(text)


def test_a_link_that_drops_while_idle_ends_reading() -> None:
    async def work() -> None:
        robot = FakeRobot(parse_settings("bolt"))
        faults = Faults(drop_when_idle=0.05)
        peripheral = Peripheral(robot.name, ADDRESS, robot=robot, services=sphero_v2(), faults=faults)
        with FakeBlueZ([peripheral]) as bluez, pytest.MonkeyPatch.context() as patch:
            patch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bluez.address)
            async with (
                asyncio.timeout(PATIENCE),
                open_transport(DeviceAddress("ble", ADDRESS), OpenOptions(timeout=5)) as connection,
            ):
                while await connection.transport.read():
                    pass
                with pytest.raises(LinkLostError):
                    await connection.transport.write(b"\x8d")

    asyncio.run(work())
