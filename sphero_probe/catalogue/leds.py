"""The LEDs of robots: the commands that set them, and the LEDs that a command sets."""

from collections.abc import Mapping
from typing import Final

from sphero_probe.catalogue.model import LedGroup, LedTable, Robot
from sphero_probe.protocol.packets import Command

Colour = tuple[int, int, int]
"""Red, green, blue, 0-255 each."""
CHANNELS: Final = ("red", "green", "blue")
"""The channels of a colour LED, in the order of its bits."""


def led_commands(robot: Robot, wanted: Mapping[str, Colour], *, off: bool = False) -> tuple[Command, ...]:
    """Return the commands that set a robot's LEDs.

    Args:
        robot: the model.
        wanted: LED name or alias -> colour; an LED with one channel takes the brightest of the three.
        off: also switch off every LED that is not named.

    Returns:
        One command where a mask selects the LEDs, otherwise one per LED in the order of the table; none where
        nothing is to be set. The commands have no target; the node for all of them is ``robot.leds.node``.
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


def leds_set(robot: Robot, command: Command) -> dict[str, object] | None:
    """Return what a command does to a robot's LEDs, the opposite of ``led_commands``.

    Args:
        robot: the model.
        command: any command.

    Returns:
        LED name -> its colour as ``ff0000``; the brightness 0-255 of an LED with one channel; ``red 255``
        where the command sets only some channels of an LED. None for a command that sets no LEDs, or whose
        mask or length does not match this robot's LEDs.
    """
    table = robot.leds
    channels = _channels_set(table, command) if table else None
    if table is None or not channels:
        return None
    leds: dict[str, object] = {}
    for group in table.groups:
        values = {bit: channels.pop(bit) for bit in group.bits if bit in channels}
        if values:
            leds[group.name] = _shown(group, values)
    return None if channels else leds


def _channels_set(table: LedTable, command: Command) -> dict[int, int] | None:
    """Return channel -> brightness, None where the command does not set these LEDs or does not match them."""
    payload = command.payload
    if not table.mask_bytes:
        for group in table.groups:
            if (table.did, group.cid) == command[:2]:
                fits = len(group.bits) <= len(payload) <= len(group.bits) + len(group.tail)
                return dict(zip(group.bits, payload, strict=False)) if fits else None
        return None
    if (table.did, table.cid) != command[:2]:
        return None
    mask, values = int.from_bytes(payload[: table.mask_bytes], "big"), payload[table.mask_bytes :]
    bits = [bit for bit in range(8 * table.mask_bytes) if mask >> bit & 1]
    fits = len(payload) > table.mask_bytes and len(bits) == len(values)
    return dict(zip(bits, values, strict=True)) if fits else None


def _shown(group: LedGroup, values: Mapping[int, int]) -> object:
    """Return the channels of one LED as one value."""
    if len(group.bits) == 1:
        return values[group.bits[0]]
    if len(values) == len(group.bits):
        return bytes(values.values()).hex()
    names = dict(zip(group.bits, CHANNELS, strict=True))
    return " ".join(f"{names[bit]} {value}" for bit, value in values.items())


def _channels(table: LedTable, wanted: Mapping[str, Colour], *, off: bool) -> dict[int, int]:
    """Return the brightness 0-255 of every channel that is to be set."""
    channels: dict[int, int] = {}
    if off:
        channels = {bit: 0 for group in table.groups for bit in group.bits}
    for name, colour in wanted.items():
        for group in table.groups:
            if name == group.name or name in group.aliases:
                channels |= _light(group, colour)
    return channels


def _masked(table: LedTable, channels: Mapping[int, int]) -> bytes:
    """Return the mask, big-endian, then a value per bit [reference: set_all_leds_with_8_bit_mask]."""
    mask = sum(1 << bit for bit in channels)
    return mask.to_bytes(table.mask_bytes, "big") + bytes(channels[bit] for bit in sorted(channels))


def _light(group: LedGroup, colour: Colour) -> dict[int, int]:
    if len(group.bits) == len(colour):
        return dict(zip(group.bits, colour, strict=True))
    return dict.fromkeys(group.bits, max(colour))
