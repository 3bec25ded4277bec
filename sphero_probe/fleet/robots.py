"""The robots of a fleet, as the user names them."""

from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

from sphero_probe.errors import UsageError
from sphero_probe.session.addressing import address_of, model_behind


class FleetRobot(NamedTuple):
    """One robot of a fleet.

    Attributes:
        name: what reports call it; different for each robot of a fleet.
        device: its address, as ``--device`` takes it.
        label: what people call it: "table 3"; may be empty.
    """

    name: str
    device: str
    label: str = ""


def fleet_of(devices: Iterable[str]) -> tuple[FleetRobot, ...]:
    """Return robots that are called after their addresses.

    Args:
        devices: addresses, as ``--device`` takes them.

    Raises:
        UsageError: there is none, one is not valid, or one is named twice.
    """
    robots = tuple(FleetRobot(device.removeprefix("ble:"), device) for device in devices)
    check_robots(robots)
    return robots


def check_robots(robots: Iterable[FleetRobot]) -> None:
    """Check that every robot can be told from the others.

    Raises:
        UsageError: there is no robot, an address is not valid, or a name or address is there twice.
    """
    robots = tuple(robots)
    if not robots:
        raise UsageError("a fleet needs at least one robot")
    for robot in robots:
        model_behind(address_of(robot.device))
    names = Counter(robot.name.casefold() for robot in robots)
    addresses = Counter(str(address_of(robot.device)) for robot in robots)
    for robot in robots:
        if addresses[str(address_of(robot.device))] > 1:
            raise UsageError(f"the robot {robot.device} is named twice")
        if names[robot.name.casefold()] > 1:
            raise UsageError(f"two robots are called {robot.name}", "give each robot a name of its own")
