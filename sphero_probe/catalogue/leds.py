"""Lamps and colours in, the arguments of the command that sets them out."""

from collections.abc import Mapping

from sphero_probe.catalogue.model import LedGroup, LedTable

Colour = tuple[int, int, int]
"""Red, green, blue, 0-255 each."""


def led_payload(table: LedTable, wanted: Mapping[str, Colour], *, off: bool = False) -> bytes:
    """Return the mask and the values that set lamps [reference: set_all_leds_with_8_bit_mask].

    Args:
        table: the robot's lamps.
        wanted: lamp name or alias -> colour; a lamp with one channel takes the brightest of the three.
        off: also darken every lamp that is not named.

    Returns:
        The mask, ``table.mask_bytes`` wide and big-endian, then one value per set bit, lowest bit first.
    """
    channels: dict[int, int] = {}
    if off:
        channels = {bit: 0 for group in table.groups for bit in group.bits}
    for name, colour in wanted.items():
        for group in table.groups:
            if name == group.name or name in group.aliases:
                channels |= _channels(group, colour)
    mask = sum(1 << bit for bit in channels)
    return mask.to_bytes(table.mask_bytes, "big") + bytes(channels[bit] for bit in sorted(channels))


def _channels(group: LedGroup, colour: Colour) -> dict[int, int]:
    if len(group.bits) == len(colour):
        return dict(zip(group.bits, colour, strict=True))
    return dict.fromkeys(group.bits, max(colour))
