"""Find robots: names and models of what advertises nearby or is connected already."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Final, NamedTuple

from bleak import BleakScanner
from bleak.backends.device import BLEDevice
from bleak.backends.scanner import AdvertisementData
from bleak.uuids import normalize_uuid_16

from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.catalogue.gatt import PROFILES
from sphero_probe.protocol.packets import Generation
from sphero_probe.transports.base import OpenOptions, Seen
from sphero_probe.transports.ble.choosing import choose, patience
from sphero_probe.transports.ble.explain import GRACE, step

if TYPE_CHECKING:
    from bleak.args.bluez import BlueZScannerArgs

_STARTING: Final = 3.0
"""Seconds that starting a scan may take, whatever time there is for listening."""
_LOOK: Final = 2.0
"""Seconds between two looks at what is connected, in a scan without end."""
_NOT_HEARD: Final = -127
"""The signal strength that bleak gives when BlueZ reports a device that it only remembers [bleak 3.1]."""
_NOT_MEASURED: Final = 127
"""What stands for an unknown signal strength [Bluetooth Core 5.2, Vol 4 Part E, 7.7.65.2]; macOS gives it."""
_GENERIC_ATTRIBUTE: Final = normalize_uuid_16(0x1801)
"""A service that every GATT device offers."""


class Heard(NamedTuple):
    """A robot, and bleak's own handle of it (an address alone is opaque on macOS)."""

    seen: Seen
    device: BLEDevice


class Air:
    """The devices found in one scan or connected, one entry for each address.

    Attributes:
        on_heard: told of everyone each time they are heard; must not raise.
    """

    def __init__(self, on_heard: Callable[[Heard], None] = lambda _: None) -> None:
        self.on_heard = on_heard
        self._heard: dict[str, Heard] = {}
        self._connected: dict[str, Heard] = {}

    def hear(self, device: BLEDevice, advertisement: AdvertisementData) -> None:
        """Add an advertisement; an empty name does not replace an earlier one.

        A device that BlueZ knows from earlier and that is not on the air is told of in the same way, without
        a signal strength. It is left out.
        """
        if advertisement.rssi <= _NOT_HEARD:
            return
        key = device.address.upper()
        before = self._heard[key].seen if key in self._heard else None
        name = advertisement.local_name or device.name or (before.name if before else "")
        offered = _generation(advertisement.service_uuids) or (before.generation if before else None)
        rssi = advertisement.rssi if advertisement.rssi < _NOT_MEASURED else None
        self._heard[key] = Heard(Seen(name, robot_by_prefix(name), device.address, rssi, offered), device)
        self.on_heard(self._merged(key))

    def meet(self, connected: Iterable[Heard]) -> None:
        """Replace the devices that are connected to this machine."""
        self._connected = {heard.seen.address.upper(): heard for heard in connected}

    def around(self) -> list[Heard]:
        """Return all devices: the strongest first, then those that are connected and do not advertise."""
        everyone = [self._merged(key) for key in self._heard | self._connected]
        return sorted(everyone, key=_by_strength)

    def _merged(self, key: str) -> Heard:
        heard, connected = self._heard.get(key), self._connected.get(key)
        if heard is None or connected is None:
            return heard or self._connected[key]
        name = heard.seen.name or connected.seen.name
        generation = heard.seen.generation or connected.seen.generation
        seen = heard.seen._replace(
            name=name, robot=robot_by_prefix(name), generation=generation, connected=True
        )
        return Heard(seen, heard.device)


def _by_strength(heard: Heard) -> tuple[float, str, str]:
    seen = heard.seen
    return (float("inf") if seen.rssi is None else -seen.rssi, seen.name, seen.address)


def _generation(services: Iterable[str]) -> Generation | None:
    """Return the protocol of these services, None where they are not a Sphero's."""
    offered = {uuid.lower() for uuid in services}
    return next((profile.generation for profile in PROFILES if profile.service in offered), None)


@asynccontextmanager
async def _listening(options: OpenOptions, air: Air) -> AsyncIterator[None]:
    """Let the air be heard.

    Raises:
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    # without duplicates BlueZ keeps quiet about a robot that another program's scan has heard as strongly
    bluez: BlueZScannerArgs = {"filters": {"DuplicateData": True}}
    if options.adapter:
        bluez["adapter"] = options.adapter
    scanner = BleakScanner(air.hear, bluez=bluez)
    async with step("scan", min(options.timeout, _STARTING) + GRACE):
        await scanner.start()
    try:
        yield
    finally:
        async with step("scan", GRACE):
            await scanner.stop()


async def _connected(options: OpenOptions) -> list[Heard]:
    """Return what is connected to this machine; nothing if the system or bleak (before 3.1) cannot tell.

    Raises:
        UnavailableError: Bluetooth was switched off, or does not answer.
    """
    try:
        from bleak import BleakAdapter
    except ImportError:  # pragma: no cover - bleak 3.0
        return []
    found: dict[str, Heard] = {}
    with suppress(NotImplementedError):
        async with step("scan", GRACE):
            adapter = await BleakAdapter.get(bluez={"adapter": options.adapter} if options.adapter else {})
            faces = [(profile.service, profile.generation) for profile in PROFILES]
            for service, generation in (*faces, (_GENERIC_ATTRIBUTE, None)):
                for device in await adapter.get_connected_devices([service]):
                    name = device.name or ""
                    seen = Seen(name, robot_by_prefix(name), device.address, None, generation, connected=True)
                    found.setdefault(device.address, Heard(seen, device))
    return list(found.values())


async def scan(options: OpenOptions, *, everything: bool = False) -> list[Seen]:
    """Return the robots that advertise nearby, strongest first, and those connected to this machine.

    Args:
        options: time and adapter.
        everything: also what is no Sphero.

    Raises:
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    air = Air()
    async with _listening(options, air):
        await asyncio.sleep(options.timeout)
        air.meet(await _connected(options))
    return [heard.seen for heard in air.around() if everything or heard.seen.is_sphero]


async def watch(options: OpenOptions, on_seen: Callable[[Seen], None], *, everything: bool = False) -> None:
    """Report every robot each time it advertises, and now and then those connected to this machine.

    Args:
        options: time, which may be infinite, and adapter.
        on_seen: told what is known of it; must not raise.
        everything: also of what is no Sphero.

    Raises:
        UnavailableError: no Bluetooth here, it does not answer, or it was switched off.
    """

    def tell(heard: Heard) -> None:
        if everything or heard.seen.is_sphero:
            on_seen(heard.seen)

    air = Air(tell)
    loop = asyncio.get_running_loop()
    end = loop.time() + options.timeout
    async with _listening(options, air):
        while (left := end - loop.time()) > 0:
            connected = await _connected(options)
            air.meet(connected)
            for one in connected:
                tell(one)
            await asyncio.sleep(min(left, _LOOK))


async def find(wanted: str, options: OpenOptions) -> Heard:
    """Return the robot of this address, this name, or the only one whose name begins so.

    An address is taken as soon as it is heard, a name after the moment in which a namesake would be heard,
    too; a beginning when everyone near must have been heard, or when the time is over.

    Raises:
        RobotNotFoundError: there is none, more than one, or it is in use already.
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    air = Air()
    async with _listening(options, air):
        air.meet(await _connected(options))
        await _until_clear(wanted, options, air)
        air.meet(await _connected(options))
    around = {heard.seen.address: heard for heard in air.around()}
    chosen = choose(wanted, (heard.seen for heard in around.values()), options.timeout)
    return around[chosen.address]


async def find_only(options: OpenOptions) -> Heard:
    """Return the one robot nearby.

    Raises:
        RobotNotFoundError: none, several, or one that is in use already.
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    return await find("", options)


async def _until_clear(wanted: str, options: OpenOptions, air: Air) -> None:
    """Scan until it is clear which robot is meant, or until the time is up."""
    loop = asyncio.get_running_loop()
    end = loop.time() + options.timeout
    with suppress(TimeoutError):
        async with asyncio.timeout_at(end) as limit:

            def shorten_deadlines(heard: Heard) -> None:
                nonlocal end
                seconds = patience(wanted, heard.seen)
                if seconds is not None and loop.time() + seconds < end:
                    end = loop.time() + seconds
                    limit.reschedule(end)

            air.on_heard = shorten_deadlines
            for heard in air.around():
                shorten_deadlines(heard)
            await asyncio.Event().wait()
    air.on_heard = lambda _: None
