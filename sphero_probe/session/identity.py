"""Is this the robot that was here before? The one place where two appearances of a robot are compared."""

from collections.abc import Mapping
from typing import NamedTuple, Self

from sphero_probe.transports.base import Connection


class Identity(NamedTuple):
    """What tells one robot from another.

    Attributes:
        robot: the model's key, empty where it is not known.
        name: the advertised name, or the address where it has none.
        firmware: node name -> version text, as far as the robot told it.
    """

    robot: str
    name: str
    firmware: Mapping[str, str] = {}

    @classmethod
    def of(cls, connection: Connection) -> Self:
        """Return what an open connection tells; the firmware is not known yet."""
        return cls(connection.robot.key if connection.robot else "", connection.name)


def difference(before: Identity, now: Identity) -> str:
    """Return what differs, in words; empty for the same robot with the same firmware.

    Firmware is compared node by node, as far as both told it.
    """
    if (before.robot, before.name) != (now.robot, now.name):
        return f"{now.name}, not {before.name}"
    return firmware_difference(before.firmware, now.firmware)


def firmware_difference(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """Return which node runs another version than before, in words; empty where none does."""
    for node in before.keys() & now.keys():
        if before[node] != now[node]:
            return f"{node} runs {now[node]}, not {before[node]}"
    return ""
