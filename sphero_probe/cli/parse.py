"""What people type becomes values: ids, ranges, names, hex bytes, colours, nodes."""

import re
from typing import Final

from sphero_probe.catalogue.naming import byte, choose, colour, command_id, device_id, id_range, pair
from sphero_probe.errors import UsageError
from sphero_probe.session.commands import node

__all__ = [
    "byte",
    "choose",
    "colour",
    "command_id",
    "device_id",
    "hex_bytes",
    "id_range",
    "is_hex",
    "node",
    "pair",
]

_HEX: Final = re.compile(r"[0-9a-fA-F]*")
_SEPARATORS: Final = re.compile(r"[\s:_,]|0[xX]")


def hex_bytes(text: str, what: str) -> bytes:
    """Return the bytes of ``8d0a13``, ``8d 0a 13``, ``8d:0a:13`` or ``0x8d 0x0a``.

    Raises:
        UsageError: not hexadecimal, or an odd number of digits.
    """
    digits = _SEPARATORS.sub("", text)
    if not _HEX.fullmatch(digits):
        raise UsageError(f"{what}: '{text}' is not hexadecimal")
    if len(digits) % 2:
        raise UsageError(f"{what}: an odd number of hex digits ({len(digits)})", "two digits make a byte")
    return bytes.fromhex(digits)


def is_hex(text: str) -> bool:
    """Whether this can only be meant as hex bytes, well written or not."""
    return bool(text) and bool(_HEX.fullmatch(_SEPARATORS.sub("", text)))
