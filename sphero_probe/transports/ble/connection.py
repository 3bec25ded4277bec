"""Open a pipe to the API characteristic of a robot, from its name or address."""

import asyncio
import logging
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager, suppress
from itertools import count
from time import monotonic
from typing import Final, NamedTuple

from bleak import BleakClient
from bleak.backends.characteristic import BleakGATTCharacteristic
from bleak.backends.service import BleakGATTServiceCollection
from bleak.exc import BleakError

from sphero_probe.catalogue.gatt import PROFILES, GattProfile
from sphero_probe.catalogue.gatt_services import list_services
from sphero_probe.errors import (
    ConnectionFailedError,
    LastingFailureError,
    RobotNotFoundError,
    SpheroProbeError,
)
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.ble.explain import (
    RAISED,
    Step,
    explain,
    step,
)
from sphero_probe.transports.ble.pipe import PATIENCE, BleTransport
from sphero_probe.transports.ble.scanner import Heard, find, find_only

_PAUSES: Final = (0.25, 0.5)
"""Seconds between attempts to connect, of which there is one more."""
_NO_API: Final = "is it a Sphero? a robot asleep may hide it: wake it and try again"
_GLANCE: Final = 0.05
"""Seconds between two looks at whether a robot that is being connected is connected already."""

for _name in ("bleak", "dbus_fast"):
    # what they warn of ends in an error anyway; without a handler it would go to standard error
    logging.getLogger(_name).addHandler(logging.NullHandler())


async def _find(wanted: str, options: OpenOptions) -> Heard:
    options.on_step("scan")
    return await find(wanted, options) if wanted else await find_only(options)


async def _note_services(client: BleakClient, connecting: Step, options: OpenOptions) -> None:
    """Wait for the link; from then on bleak only waits for the services."""
    while not client.is_connected:  # noqa: ASYNC110 - bleak has no event for it
        await asyncio.sleep(_GLANCE)
    connecting.name = "services"
    options.on_step(connecting.name)


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
        # bleak keeps the time itself; tidying up takes BlueZ two seconds
        async with step("connect", options.timeout + PATIENCE) as connecting:
            noting = asyncio.create_task(_note_services(client, connecting, options))
            try:
                await client.connect()
            finally:
                noting.cancel()
        if connecting.name == "connect":
            options.on_step("services")
        connected.set()
        yield client
    finally:
        with suppress(*RAISED, AssertionError):  # bleak asserts that it has tidied up
            async with asyncio.timeout(PATIENCE):
                await client.disconnect()


def _services(client: BleakClient) -> BleakGATTServiceCollection:
    """Return what discovery found; bleak forgets it when the link drops, so that it is asked once.

    Raises:
        ConnectionFailedError: the link dropped already.
    """
    try:
        return client.services
    except BleakError as error:
        raise explain(error, "services") from error


def _uuids(services: BleakGATTServiceCollection) -> tuple[str, ...]:
    return tuple(service.uuid for service in sorted(services, key=lambda service: service.handle))


def _characteristic(services: BleakGATTServiceCollection, uuid: str) -> BleakGATTCharacteristic | None:
    """Return the first of this kind; a robot may show several, or none."""
    return next((one for one in services.characteristics.values() if one.uuid == uuid), None)


async def _unlock(client: BleakClient, services: BleakGATTServiceCollection, options: OpenOptions) -> bool:
    """Write the phrases that the robot has characteristics for; return whether there were any."""
    unlocked = False
    for uuid, phrase in (entry for profile in PROFILES for entry in profile.unlock):
        lock = _characteristic(services, uuid)
        if lock is None:
            continue
        if not unlocked:
            options.on_step("handshake")
        unlocked = True
        async with step("handshake", options.timeout):
            await client.write_gatt_char(lock, phrase, response="write" in lock.properties)
    return unlocked


class _Face(NamedTuple):
    """How a robot is spoken to.

    Attributes:
        profile: the generation's.
        commands: where they are written.
        answers: where they are notified.
    """

    profile: GattProfile
    commands: BleakGATTCharacteristic
    answers: BleakGATTCharacteristic


def _face(services: BleakGATTServiceCollection) -> _Face | None:
    """Return the first profile that the robot's services show, None where they show none."""
    for profile in PROFILES:
        commands = _characteristic(services, profile.commands)
        answers = _characteristic(services, profile.answers)
        if commands and answers:
            return _Face(profile, commands, answers)
    return None


@contextmanager
def _telling(services: BleakGATTServiceCollection) -> Iterator[None]:
    """Add the services that the robot has to whatever fails with them."""
    try:
        yield
    except ConnectionFailedError as error:
        said = f"{error}; it has: {list_services(_uuids(services))}"
        raise type(error)(said, error.hint) from error


@asynccontextmanager
async def _attempt(heard: Heard, options: OpenOptions) -> AsyncIterator[Connection]:
    """Connect to a robot that was heard, unlock it and listen to it."""
    gone = asyncio.Event()
    async with AsyncExitStack() as opened:
        client = await opened.enter_async_context(_client(heard, options, gone))
        services = _services(client)
        with _telling(services):
            unlocked = await _unlock(client, services, options)
        face = _face(services)
        if face is None and unlocked:
            # some droids reveal the API only now; a second client discovers services again on the same link
            client = await opened.enter_async_context(_client(heard, options, gone))
            services = _services(client)
            face = _face(services)
        with _telling(services):
            if face is None:
                raise LastingFailureError("services: this robot shows no Sphero API to write to", _NO_API)
            transport = BleTransport(client, face.commands)
            hang_up = asyncio.create_task(_tell_when(gone, transport), name="disconnect watch")
            opened.callback(hang_up.cancel)
            opened.callback(transport.on_disconnect)
            options.on_step("notify")
            async with step("notify", options.timeout):
                await client.start_notify(face.answers, transport.on_notification)
        seen, generation = heard.seen, face.profile.generation
        robot = seen.robot if seen.robot and seen.robot.generation is generation else None
        yield Connection(
            *(transport, generation, robot, seen.name or seen.address, f"ble:{seen.address}"),
            services=_uuids(services),
            write_size=transport.write_size,
        )


async def _tell_when(gone: asyncio.Event, transport: BleTransport) -> None:
    await gone.wait()
    transport.on_disconnect()


@asynccontextmanager
async def open_connection(rest: str, options: OpenOptions) -> AsyncIterator[Connection]:
    """Connect to the robot of this name or address; to the only one nearby when ``rest`` is empty.

    An attempt that fails is repeated with a new client, unless it cannot end otherwise; a robot that vanished
    is scanned for again.

    Raises:
        RobotNotFoundError: no such robot, or more than one.
        ConnectionFailedError: a step failed; the message names it.
        UnavailableError: no Bluetooth here.
    """
    heard = await _find(rest, options)
    began = monotonic()
    async with AsyncExitStack() as opened:
        options.on_step("connect")
        for number in count(1):
            try:
                connection = await opened.enter_async_context(_attempt(heard, options))
                break
            except LastingFailureError:
                raise
            except (RobotNotFoundError, ConnectionFailedError) as error:
                if number > len(_PAUSES):
                    raise _after(error, number, monotonic() - began) from error
                why = error
            await asyncio.sleep(_PAUSES[number - 1])
            if isinstance(why, RobotNotFoundError):
                heard = await _find(heard.seen.address, options)
            options.on_step(f"connect, attempt {number + 1}: {why}")
        yield connection


def _after(error: SpheroProbeError, attempts: int, seconds: float) -> SpheroProbeError:
    return type(error)(f"{error} ({attempts} attempts in {seconds:.1f} s)", error.hint)
