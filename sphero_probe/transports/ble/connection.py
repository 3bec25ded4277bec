"""A name or address goes in, an open pipe to the robot's API characteristic comes out."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from typing import Final

from bleak import BleakClient
from bleak.backends.characteristic import BleakGATTCharacteristic
from bleak.exc import BleakError

from sphero_probe.catalogue.gatt import PROFILES, GattProfile
from sphero_probe.errors import (
    ConnectionFailedError,
    LinkLostError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
)
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.ble.explain import GRACE, step
from sphero_probe.transports.ble.scanner import Heard, find, find_only

_PAUSES: Final = (0.25, 0.5, 1.0)
"""Seconds between attempts to connect."""
_WRITE_TIMEOUT: Final = 5.0
_SMALLEST_SLICE: Final = 20
"""Bytes that every BLE link takes in one write."""


class BleTransport:
    """A pipe into one characteristic and out of one; the callback only enqueues.

    Attributes:
        write_size: bytes that one write carries at most: the negotiated MTU less 3.
    """

    def __init__(self, client: BleakClient, commands: BleakGATTCharacteristic) -> None:
        self._client = client
        self._commands = commands
        self.write_size = max(_SMALLEST_SLICE, commands.max_write_without_response_size)
        self._response = "write-without-response" not in commands.properties
        self._heard: asyncio.Queue[bytes] = asyncio.Queue()

    async def write(self, data: bytes) -> None:
        """Send bytes in slices that the negotiated MTU allows.

        Raises:
            LinkLostError: the robot is gone.
        """
        try:
            async with step("write", _WRITE_TIMEOUT):
                for at in range(0, len(data), self.write_size):
                    await self._client.write_gatt_char(
                        self._commands, data[at : at + self.write_size], response=self._response
                    )
        except SpheroProbeError as error:
            raise LinkLostError(f"the link to the robot is lost ({error})", error.hint) from error

    async def read(self) -> bytes:
        """Wait for a notification; ``b""`` once the robot is gone."""
        data = await self._heard.get()
        if not data:
            self._heard.put_nowait(data)  # whoever reads again finds it gone, too
        return data

    def on_notification(self, _: BleakGATTCharacteristic, data: bytearray) -> None:
        """Take in what the robot notified."""
        if data:
            self._heard.put_nowait(bytes(data))

    def on_disconnect(self) -> None:
        """Take in that the robot is gone."""
        self._heard.put_nowait(b"")


async def _find(wanted: str, options: OpenOptions) -> Heard:
    options.on_step("scan")
    return await find(wanted, options) if wanted else await find_only(options)


@asynccontextmanager
async def _client(heard: Heard, options: OpenOptions, gone: asyncio.Event) -> AsyncIterator[BleakClient]:
    """Connect one client, and disconnect it whatever happened meanwhile."""
    connected = asyncio.Event()

    def on_disconnect(_: BleakClient) -> None:
        if connected.is_set():  # bleak also calls this for each attempt that it repeats by itself
            gone.set()

    client = BleakClient(
        heard.device,
        disconnected_callback=on_disconnect,
        timeout=options.timeout,
        bluez={"adapter": options.adapter} if options.adapter else {},
    )
    try:
        async with step("connect", options.timeout + GRACE):  # bleak keeps the time itself, and tidies up
            await client.connect()
        connected.set()
        yield client
    finally:
        with suppress(BleakError, OSError, EOFError, TimeoutError):
            async with asyncio.timeout(_WRITE_TIMEOUT):
                await client.disconnect()


async def _connect(
    wanted: str, options: OpenOptions, gone: asyncio.Event, opened: AsyncExitStack
) -> tuple[Heard, BleakClient]:
    """Find and connect; a failed attempt is repeated, a robot that vanished is scanned for again."""
    heard = await _find(wanted, options)
    for pause in _PAUSES:
        options.on_step("connect")
        try:
            return heard, await opened.enter_async_context(_client(heard, options, gone))
        except UnavailableError:
            raise
        except RobotNotFoundError:
            await asyncio.sleep(pause)
            heard = await _find(wanted, options)
        except ConnectionFailedError:
            await asyncio.sleep(pause)
    options.on_step("connect")
    return heard, await opened.enter_async_context(_client(heard, options, gone))


async def _unlock(client: BleakClient, options: OpenOptions) -> bool:
    """Write the phrases that the robot has characteristics for; tell whether there were any."""
    unlocked = False
    for uuid, phrase in (entry for profile in PROFILES for entry in profile.unlock):
        lock = client.services.get_characteristic(uuid)
        if lock is None:
            continue
        if not unlocked:
            options.on_step("handshake")
        unlocked = True
        async with step("handshake", options.timeout):
            await client.write_gatt_char(lock, phrase, response=True)
    return unlocked


def _face(client: BleakClient) -> GattProfile | None:
    """Return the profile that the robot's services show, None where they show none."""
    characteristics = client.services
    for profile in PROFILES:
        ends = (profile.commands, profile.answers)
        if all(characteristics.get_characteristic(uuid) for uuid in ends):
            return profile
    return None


def _characteristic(client: BleakClient, uuid: str) -> BleakGATTCharacteristic:
    found = client.services.get_characteristic(uuid)
    if found is None:
        raise _no_api(client)
    return found


def _no_api(client: BleakClient) -> ConnectionFailedError:
    found = ", ".join(service.uuid for service in client.services) or "none"
    return ConnectionFailedError(
        f"services: this robot has no Sphero API; it has: {found}",
        "is it a Sphero? a robot asleep may hide it: wake it and try again",
    )


@asynccontextmanager
async def open_connection(rest: str, options: OpenOptions) -> AsyncIterator[Connection]:
    """Connect to the robot of this name or address; to the only one nearby when ``rest`` is empty.

    Raises:
        RobotNotFoundError: no such robot, or more than one.
        ConnectionFailedError: a step failed; the message names it.
        UnavailableError: no Bluetooth here.
    """
    gone = asyncio.Event()
    async with AsyncExitStack() as opened:
        heard, client = await _connect(rest, options, gone, opened)
        unlocked = await _unlock(client, options)
        profile = _face(client)
        if profile is None and unlocked:
            # some droids reveal the API only now; a second client discovers services anew on the same link
            options.on_step("services")
            client = await opened.enter_async_context(_client(heard, options, gone))
            profile = _face(client)
        if profile is None:
            raise _no_api(client)
        transport = BleTransport(client, _characteristic(client, profile.commands))
        hang_up = asyncio.create_task(_tell_when(gone, transport), name="disconnect watch")
        opened.callback(hang_up.cancel)
        opened.callback(transport.on_disconnect)
        options.on_step("notify")
        async with step("notify", options.timeout):
            answers = _characteristic(client, profile.answers)
            await client.start_notify(answers, transport.on_notification)
        seen = heard.seen
        robot = seen.robot if seen.robot and seen.robot.generation is profile.generation else None
        yield Connection(
            *(transport, profile.generation, robot, seen.name or seen.address, f"ble:{seen.address}"),
            services=tuple(service.uuid for service in client.services),
            write_size=transport.write_size,
        )


async def _tell_when(gone: asyncio.Event, transport: BleTransport) -> None:
    await gone.wait()
    transport.on_disconnect()
