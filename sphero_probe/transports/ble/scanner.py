"""The air goes in, robots come out: names and models of what advertises nearby."""

import asyncio
from typing import NamedTuple

from bleak import BleakScanner
from bleak.backends.device import BLEDevice
from bleak.backends.scanner import AdvertisementData

from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.catalogue.gatt import PROFILES
from sphero_probe.errors import RobotNotFoundError
from sphero_probe.transports.base import OpenOptions, Seen
from sphero_probe.transports.ble.explain import GRACE, step


class Heard(NamedTuple):
    """A robot, and bleak's own handle of it (an address alone is opaque on macOS)."""

    seen: Seen
    device: BLEDevice


def _is_robot(device: BLEDevice, advertisement: AdvertisementData) -> bool:
    name = advertisement.local_name or device.name or ""
    return robot_by_prefix(name) is not None or any(
        profile.service in advertisement.service_uuids for profile in PROFILES
    )


def _heard(device: BLEDevice, advertisement: AdvertisementData) -> Heard:
    name = advertisement.local_name or device.name or ""
    return Heard(Seen(name, robot_by_prefix(name), device.address, advertisement.rssi), device)


def _scanner(adapter: str) -> BleakScanner:
    return BleakScanner(bluez={"adapter": adapter} if adapter else {})


async def listen(options: OpenOptions, *, everything: bool = False) -> list[Heard]:
    """Listen for ``options.timeout`` seconds; strongest first.

    Args:
        options: time and adapter.
        everything: also what is no Sphero.

    Raises:
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    heard: dict[str, Heard] = {}
    async with step("scan", options.timeout + GRACE):
        async with _scanner(options.adapter) as scanner:
            await asyncio.sleep(options.timeout)
        for device, advertisement in scanner.discovered_devices_and_advertisement_data.values():
            if everything or _is_robot(device, advertisement):
                heard[device.address] = _heard(device, advertisement)
    return sorted(heard.values(), key=lambda h: (-h.seen.rssi, h.seen.name))


async def scan(options: OpenOptions, *, everything: bool = False) -> list[Seen]:
    """Return the robots that advertise nearby, strongest first.

    Raises:
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    return [heard.seen for heard in await listen(options, everything=everything)]


async def find(wanted: str, options: OpenOptions) -> Heard:
    """Return the robot of this name or address as soon as it is heard.

    Raises:
        RobotNotFoundError: nobody of that name within the time.
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    folded = wanted.casefold()
    async with step("scan", options.timeout + GRACE), _scanner(options.adapter) as scanner:
        try:
            async with asyncio.timeout(options.timeout):
                async for device, advertisement in scanner.advertisement_data():
                    name = advertisement.local_name or device.name or ""
                    if folded in (name.casefold(), device.address.casefold()):
                        return _heard(device, advertisement)
        except TimeoutError:
            pass
    raise RobotNotFoundError(
        f"no robot '{wanted}' was heard within {options.timeout:g} s",
        "is it awake (shake it), in range, and not connected to a phone? see: sphero-probe scan",
    )


async def find_only(options: OpenOptions) -> Heard:
    """Return the one robot nearby.

    Raises:
        RobotNotFoundError: none, or several.
        UnavailableError: no Bluetooth here, or it does not answer.
    """
    robots = await listen(options)
    if not robots:
        raise RobotNotFoundError(
            f"no robot was heard within {options.timeout:g} s",
            "is it awake (shake it), in range, and not connected to a phone? or try --device fake:bolt-plus",
        )
    if len(robots) > 1:
        names = ", ".join(heard.seen.name or heard.seen.address for heard in robots)
        raise RobotNotFoundError(
            f"{len(robots)} robots are near: {names}", f"choose one: --device {robots[0].seen.name}"
        )
    return robots[0]
