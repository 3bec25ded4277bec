"""The keys of catalogue rows: the evidence for a command, and the LEDs of a robot."""

from sphero_probe.catalogue.leds import CHANNELS
from sphero_probe.catalogue.model import CommandRow, LedGroup, Robot
from sphero_probe.catalogue.provenance import sightings_of, sources_for, switch_of


def evidence_keys(command: CommandRow) -> dict[str, object]:
    """Return the sources of a command, and where it was seen.

    ``provenance`` says which sources name each robot, ``firmware`` where the command was reported to exist or
    not, ``enabled_by`` what makes a robot send a notification, ``since`` the first firmware that has it.
    """
    switch = switch_of(command)
    return {
        "provenance": {key: list(sources_for(command, key)) for key in command.nodes},
        "firmware": [
            {
                "robot": seen.robot,
                "firmware": seen.firmware,
                "node": seen.node,
                "exists": seen.exists,
                "source": seen.source,
            }
            for seen in sightings_of(command)
        ],
        "enabled_by": switch.name if switch else None,
        "since": command.since or None,
    }


def led_keys(robot: Robot, group: LedGroup) -> dict[str, object]:
    """Return the keys of one LED; ``channels`` are its bits by colour, or as ``brightness``."""
    channels = CHANNELS if len(group.bits) == len(CHANNELS) else ("brightness",)
    return {
        "robot": robot.key,
        "name": group.name,
        "aliases": list(group.aliases),
        "channels": dict(zip(channels, group.bits, strict=True)),
    }
