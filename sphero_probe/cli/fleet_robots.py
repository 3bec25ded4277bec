"""Finds the robots of a fleet, and what reaches them: Bluetooth adapters, or workers of a Dask scheduler."""

import asyncio
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from sphero_probe.cli.complete.last_scan import remember
from sphero_probe.cli.values import FleetConnectOptions
from sphero_probe.errors import RobotNotFoundError
from sphero_probe.fleet.action import Action
from sphero_probe.fleet.adapters import Adapters, adapter_names
from sphero_probe.fleet.dask.installed import check_dask
from sphero_probe.fleet.fleet import Fleet, JournalFor
from sphero_probe.fleet.on_robot import RobotOptions
from sphero_probe.fleet.robots import FleetRobot, fleet_of
from sphero_probe.fleet.robots_file import read_robots
from sphero_probe.session.addressing import address_of
from sphero_probe.transports.base import TRY_FAKE, WHY_UNHEARD, OpenOptions, Seen
from sphero_probe.transports.registry import scan


async def chosen_robots(connecting: FleetConnectOptions) -> tuple[FleetRobot, ...]:
    """Return the robots that the options name; ``--all`` scans for them, or asks the workers.

    Raises:
        ConnectionFailedError: the scheduler cannot be reached.
        UsageError: an address is not valid, or a robot is named twice.
        BadInputFileError: the fleet file is not valid.
        RobotNotFoundError: no robot is near.
        UnavailableError: Bluetooth cannot be used here.
    """
    if connecting.scheduler:
        check_dask()
    if connecting.file is not None:
        return read_robots(Path(connecting.file))
    if connecting.devices:
        return fleet_of(connecting.devices)
    if connecting.scheduler:
        return await _offered_robots(connecting.scheduler)
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


async def _offered_robots(scheduler: str) -> tuple[FleetRobot, ...]:
    """Return the robots that workers offer, by name.

    Raises:
        ConnectionFailedError: the scheduler cannot be reached.
        RobotNotFoundError: no worker offers a robot.
    """
    from sphero_probe.fleet.dask.cluster import offered_robots  # noqa: PLC0415 - an extra

    robots = await offered_robots(scheduler)
    if not robots:
        raise RobotNotFoundError(
            f"no worker of {scheduler} offers a robot",
            f"near the robots, run: sphero-probe fleet worker --scheduler {scheduler}",
        )
    return fleet_of(robots)


async def fleet_for(
    connecting: FleetConnectOptions,
    robots: Sequence[FleetRobot],
    action: Action,
    journal_for: JournalFor,
    *,
    options: RobotOptions,
    stop: asyncio.Event,
    finished: Mapping[str, Path],
) -> Fleet:
    """Return the fleet to run: on this host or, with ``--scheduler``, on the workers that reach the robots.

    Args:
        connecting: which of the two, and the adapters of this host.
        robots: which.
        action: what to do on each.
        journal_for: returns the journal of one robot.
        options: how to connect, and what may be sent.
        stop: ends every run.
        finished: robot name -> journal of a complete run.
    """
    if not connecting.scheduler:
        adapters = await adapters_for(robots, connecting)
        return Fleet(
            *(robots, action, journal_for), options=options, adapters=adapters, stop=stop, finished=finished
        )
    from sphero_probe.fleet.dask.client import WAIT, DaskFleet  # noqa: PLC0415 - an extra

    return DaskFleet(
        *(robots, action, journal_for),
        scheduler=connecting.scheduler,
        wait=connecting.wait or WAIT,
        options=options,
        stop=stop,
        finished=finished,
    )


async def adapters_for(robots: Iterable[FleetRobot], connecting: FleetConnectOptions) -> Adapters:
    """Return the adapters to share among these robots; the system is asked only if one needs Bluetooth."""
    names = connecting.adapters
    if not names and any(address_of(robot.device).scheme == "ble" for robot in robots):
        names = await adapter_names()
    return Adapters(names or ("",), connecting.per_adapter)
