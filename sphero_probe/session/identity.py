"""Compare two robots: the one before and the one now, by model, name and firmware."""

from collections.abc import Mapping
from typing import NamedTuple, Self

from sphero_probe.transports.base import Connection


class Identity(NamedTuple):
    """What distinguishes one robot from another.

    Attributes:
        robot: the model's key, empty if it is not known.
        name: the advertised name, or the address where it has none.
        firmware: node name -> version text, for the nodes that answered.
    """

    robot: str
    name: str
    firmware: Mapping[str, str] = {}

    @classmethod
    def of(cls, connection: Connection) -> Self:
        """Return the identity of a connected robot, without its firmware."""
        return cls(connection.robot.key if connection.robot else "", connection.name)


def difference(before: Identity, now: Identity) -> str:
    """Return what differs, in words; empty for the same robot with the same firmware.

    Firmware is compared for the nodes that both have.
    """
    if (before.robot, before.name) != (now.robot, now.name):
        return f"{now.name}, not {before.name}"
    return firmware_difference(before.firmware, now.firmware)


def firmware_difference(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """Return which node runs another version than before, in words; empty if none does."""
    for node in before.keys() & now.keys():
        if before[node] != now[node]:
            return f"{node} runs {now[node]}, not {before[node]}"
    return ""
