"""The sources of each row, per robot, and the firmware versions that are known to have or lack its command.

The robots in a row come from very different sources: one was captured, another is listed in a class that was
never run, a third is listed because related models have the command. ``sources_for`` says which is which.
"""

from typing import Final, NamedTuple

from sphero_probe.catalogue.commands import commands_of, row_by_name
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.robots import ROBOTS

SOURCES: Final[dict[str, str]] = {
    "spherov2": "spherov2, a Python library",
    "sdk": "the maker's Python SDK for RVR",
    "spherojs": "the maker's JavaScript SDK",
    "iossdk": "headers of the maker's iOS SDK",
    "api": "the maker's description of V1",
    "pysphero": "pysphero, a Python library",
    "spherov2js": "spherov2.js, a JavaScript library",
    "unsw": "a class for BOLT+ that its package marks as untested",
    "capture": "bytes seen from a robot",
    "reference": "a description of BOLT+",
    "assumed": "what its relatives have",
}
"""Every word in ``CommandRow.sources``, and what it means."""
UNTESTED: Final = frozenset({"unsw"})
"""Sources whose claims were never tested."""
ONE_UNTESTED_SOURCE: Final = "reported by one untested source"
ASSUMED: Final = "assumed from its relatives"

_UNNAMED: Final = frozenset({"rvr-plus", "sprk"})
"""Robots that are in no source."""
_OWN: Final[dict[str, tuple[str, ...]]] = {
    "bolt": ("spherov2", "capture"),
    "bolt-plus": ("reference", "unsw"),
    "mini": ("spherov2", "spherov2js"),
    "rvr": ("sdk", "spherov2", "capture"),
    "r2d2": ("spherov2", "capture"),
    "r2q5": ("spherov2",),
    "bb9e": ("spherov2",),
    "lmq": ("pysphero",),
    "sphero": ("spherov2", "spherojs", "api"),
    "sprk-plus": ("spherov2",),
    "ollie": ("spherov2",),
    "bb8": ("spherov2",),
}
"""Robot key -> the sources that name this robot; the other sources describe robots in general."""
_UNSPECIFIC: Final = {
    "lmq": "pysphero",
    "sphero": "spherov2",
    "sprk-plus": "spherov2",
    "ollie": "spherov2",
    "bb8": "spherov2",
}
"""Robot key -> the source that names the robot only in rows without ``assumed``."""


def sources_for(row: CommandRow, robot_key: str) -> tuple[str, ...]:
    """Return the sources that list this pair for this robot; ``("assumed",)`` where none does.

    Args:
        row: the row of the pair.
        robot_key: one of ``row.nodes``.
    """
    own = () if robot_key in _UNNAMED else _OWN.get(robot_key, ())
    if "assumed" in row.sources:  # then these sources name the command, but not this robot
        own = tuple(source for source in own if source != _UNSPECIFIC.get(robot_key))
    return tuple(source for source in own if source in row.sources) or ("assumed",)


def provenance_note(row: CommandRow, robot: Robot | None) -> str:
    """Return a remark where the evidence that a robot has this pair is weak, otherwise an empty string."""
    if robot is None or robot.key not in row.nodes:
        return ""
    sources = sources_for(row, robot.key)
    if UNTESTED.issuperset(sources):
        return ONE_UNTESTED_SOURCE
    return ASSUMED if sources == ("assumed",) else ""


class Sighting(NamedTuple):
    """One report of a command on one firmware.

    Attributes:
        robot: key of the model.
        firmware: the version, ``9.1.462``.
        node: number of the node it was asked on, None where the report does not say.
        did: device id.
        cid: command id.
        exists: the command exists; False: the robot responded that there is no such command.
        source: who reported it.
    """

    robot: str
    firmware: str
    node: int | None
    did: int
    cid: int
    exists: bool
    source: str


_ATRIZ: Final = "Bura-hub/Atriz_migracion_ros2"
_ISSUE: Final = "sphero-sdk-raspberrypi-nodejs#6"
SIGHTINGS: Final = (
    Sighting("r2d2", "7.0.101", None, 0x17, 0x2C, exists=False, source="zaremy/r2-z2"),
    Sighting("rvr", "9.1.462", 1, 0x13, 0x27, exists=False, source=f"{_ATRIZ}, evidence 41"),
    Sighting("rvr", "9.2.482", 2, 0x13, 0x27, exists=False, source=f"{_ATRIZ}, evidence 41"),
    Sighting("rvr", "9.1.462", 1, 0x18, 0x52, exists=False, source=f"{_ATRIZ}, evidence 41"),
    Sighting("rvr", "9.2.482", 2, 0x18, 0x52, exists=False, source=f"{_ATRIZ}, evidence 41"),
    Sighting("rvr", "8.3.432", 1, 0x18, 0x52, exists=True, source=f"{_ATRIZ}, evidence 42"),
    Sighting("rvr", "8.6.448", 2, 0x18, 0x52, exists=True, source=f"{_ATRIZ}, evidence 42"),
    Sighting("rvr", "8.3.432", 1, 0x18, 0x39, exists=True, source=_ISSUE),
    Sighting("rvr", "9.1.462", 1, 0x11, 0x00, exists=True, source=f"{_ATRIZ}, UART log"),
    Sighting("rvr", "9.1.462", 1, 0x13, 0x0D, exists=True, source=f"{_ATRIZ}, UART log"),
)
"""Public reports about robots that state the firmware version."""


def sightings_of(row: CommandRow, robot: Robot | None = None) -> tuple[Sighting, ...]:
    """Return the reports about a row's pair, on one robot or on all robots of the row."""
    return tuple(
        seen
        for seen in SIGHTINGS
        if (seen.did, seen.cid) == (row.did, row.cid)
        and seen.robot in row.nodes
        and (robot is None or seen.robot == robot.key)
        and ROBOTS[seen.robot].generation is row.generation
    )


def firmware_note(row: CommandRow, robot: Robot | None, *, exists: bool, firmware: str = "") -> str:
    """Return a remark on other firmware versions that are known to have or lack a command.

    Args:
        row: the row of the pair.
        robot: the model; None gives no remark.
        exists: whether this robot has the command.
        firmware: the version that this robot runs, empty where it is not known.

    Returns:
        ``known absent on 9.2.482 too``, ``known to answer on 8.3.432``, or empty.
    """
    if robot is None:
        return ""
    words = []
    for wanted, phrase in ((False, "known absent on"), (True, "known to answer on")):
        versions = [
            seen.firmware
            for seen in sightings_of(row, robot)
            if seen.exists is wanted and not (seen.firmware == firmware and seen.exists is exists)
        ]
        if versions and not (exists and wanted):
            too = " too" if wanted is exists else ""
            words.append(f"{phrase} {' and '.join(dict.fromkeys(versions))}{too}")
    return "; ".join(words)


def absence_note(row: CommandRow | None, robot: Robot | None, firmware: str = "") -> str:
    """Return a remark for a command that this robot does not have, or an empty string.

    Args:
        row: the row of the pair, None where it is not known.
        robot: the model.
        firmware: the version that it runs, empty where it is not known.
    """
    if row is None:
        return ""
    notes = (firmware_note(row, robot, exists=False, firmware=firmware), provenance_note(row, robot))
    return "; ".join(filter(None, notes))


def switch_of(row: CommandRow) -> CommandRow | None:
    """Return the command that makes a robot send a notification; None for commands, or if not known.

    If the row does not name it, it is the command ``enable_…`` with the notification's name.
    """
    if row.kind is not Kind.NOTIFICATION:
        return None
    if row.enabled_by:
        return row_by_name(row.generation, row.enabled_by)
    device, _, name = row.name.partition(".")
    wanted = f"{device}.enable_{name}"
    switches = (
        command
        for key in row.nodes
        for command in commands_of(ROBOTS[key])
        if command.name == wanted and command.kind is Kind.COMMAND
    )
    return next(switches, None)
