"""Finds the robots and the Bluetooth adapters of a fleet."""

import asyncio
from collections.abc import Iterable, Sequence
from pathlib import Path

from sphero_probe.cli.complete.last_scan import remember
from sphero_probe.cli.values import FleetConnectOptions
from sphero_probe.errors import RobotNotFoundError
from sphero_probe.fleet.adapters import Adapters, adapter_names
from sphero_probe.fleet.robots import FleetRobot, fleet_of
from sphero_probe.fleet.robots_file import read_robots
from sphero_probe.session.addressing import address_of
from sphero_probe.transports.base import TRY_FAKE, WHY_UNHEARD, OpenOptions, Seen
from sphero_probe.transports.registry import scan


async def chosen_robots(connecting: FleetConnectOptions) -> tuple[FleetRobot, ...]:
    """Return the robots that the options name; ``--all`` scans for them.

    Raises:
        UsageError: an address is not valid, or a robot is named twice.
        BadInputFileError: the fleet file is not valid.
        RobotNotFoundError: no robot is near.
        UnavailableError: Bluetooth cannot be used here.
    """
    if connecting.file is not None:
        return read_robots(Path(connecting.file))
    if connecting.devices:
        return fleet_of(connecting.devices)
    robots = robots_of(await scan_all(connecting.connect_timeout, connecting.adapters))
    if not robots:
        seconds = connecting.connect_timeout
        raise RobotNotFoundError(f"no robot was heard within {seconds:g} s", f"{WHY_UNHEARD} {TRY_FAKE}")
    return robots


async def scan_all(seconds: float, adapters: Sequence[str]) -> list[Seen]:
    """Return the robots that any adapter hears, the strongest first; each robot once.

    Args:
        seconds: how long to listen.
        adapters: the adapters to use, empty for all.

    Raises:
        UnavailableError: Bluetooth cannot be used here.
    """
    names = adapters or await adapter_names()
    heard = await asyncio.gather(*(scan(OpenOptions(seconds, name)) for name in names))
    strongest = sorted((seen for one in heard for seen in one), key=lambda seen: -(seen.rssi or -128))
    found: dict[str, Seen] = {}
    for seen in strongest:
        found.setdefault(seen.address, seen)
    remember(found.values())
    return list(found.values())


def robots_of(seen: Iterable[Seen]) -> tuple[FleetRobot, ...]:
    """Return the robots of a scan as a fleet, by name; a name that is there already becomes the address."""
    robots: dict[str, FleetRobot] = {}
    for one in sorted(seen, key=lambda robot: (robot.name.casefold(), robot.address)):
        name = one.name.strip()
        taken = not name or name.casefold() in robots
        robot = FleetRobot(one.address if taken else name, one.address)
        robots[robot.name.casefold()] = robot
    return tuple(robots.values())


async def adapters_for(robots: Iterable[FleetRobot], connecting: FleetConnectOptions) -> Adapters:
    """Return the adapters to share among these robots; the system is asked only if one needs Bluetooth."""
    names = connecting.adapters
    if not names and any(address_of(robot.device).scheme == "ble" for robot in robots):
        names = await adapter_names()
    return Adapters(names or ("",), connecting.per_adapter)
