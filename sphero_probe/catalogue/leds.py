"""Lamps and colours in, the commands that set them out."""

from collections.abc import Mapping

from sphero_probe.catalogue.model import LedGroup, LedTable, Robot
from sphero_probe.protocol.packets import Command

Colour = tuple[int, int, int]
"""Red, green, blue, 0-255 each."""


def led_commands(robot: Robot, wanted: Mapping[str, Colour], *, off: bool = False) -> tuple[Command, ...]:
    """Return the commands that set a robot's lamps.

    Args:
        robot: whose lamps.
        wanted: lamp name or alias -> colour; a lamp with one channel takes the brightest of the three.
        off: also darken every lamp that is not named.

    Returns:
        One command where a mask selects the lamps, otherwise one per lamp in the order of the table; none
        where nothing is to be set. Their targets are left open: ``robot.leds.node`` serves them all.
    """
    table = robot.leds
    if table is None:
        return ()
    channels = _channels(table, wanted, off=off)
    if not channels:
        return ()
    if table.mask_bytes:
        return (Command(table.did, table.cid, _masked(table, channels)),)
    return tuple(
        Command(table.did, group.cid, bytes(channels[bit] for bit in group.bits) + group.tail)
        for group in table.groups
        if group.cid is not None and group.bits[0] in channels
    )


def _channels(table: LedTable, wanted: Mapping[str, Colour], *, off: bool) -> dict[int, int]:
    """Return the brightness 0-255 of every channel that is to be set."""
    channels: dict[int, int] = {}
    if off:
        channels = {bit: 0 for group in table.groups for bit in group.bits}
    for name, colour in wanted.items():
        for group in table.groups:
            if name == group.name or name in group.aliases:
                channels |= _shine(group, colour)
    return channels


def _masked(table: LedTable, channels: Mapping[int, int]) -> bytes:
    """Return the mask, big-endian, then a value per bit [reference: set_all_leds_with_8_bit_mask]."""
    mask = sum(1 << bit for bit in channels)
    return mask.to_bytes(table.mask_bytes, "big") + bytes(channels[bit] for bit in sorted(channels))


def _shine(group: LedGroup, colour: Colour) -> dict[int, int]:
    if len(group.bits) == len(colour):
        return dict(zip(group.bits, colour, strict=True))
    return dict.fromkeys(group.bits, max(colour))
