"""Advertising data without names and identifiers: what says which kind of device it is stays.

From the Bluetooth Core Specification Supplement, part A, and the assigned numbers of its types.
"""

from typing import Final

from sphero_probe.captures.redaction.pseudonyms import Pseudonyms, without_text

_NAMES: Final = frozenset({0x08, 0x09})
_FIXED: Final = {0x01: 1, 0x0A: 1, 0x0D: 3, 0x12: 4, 0x19: 2, 0x1A: 2, 0x1C: 1, 0x27: 8}
"""Flags, power, class, intervals, appearance, role, features -> bytes; a name may be of another length."""
_SERVICES: Final = {0x02: 2, 0x03: 2, 0x14: 2, 0x04: 4, 0x05: 4, 0x06: 16, 0x07: 16, 0x15: 16}
"""Lists of services -> bytes of each."""
_UUID: Final = 16
_ADDRESSES: Final = frozenset({0x17, 0x18})
"""Public and random target addresses."""
_MANUFACTURER: Final = 0xFF
_SERVICE_DATA: Final = {0x16: 2, 0x20: 4, 0x21: 16, _MANUFACTURER: 2}
"""Types whose first bytes say whose data follow, and how many those are."""


def redacted_advertising(data: bytes, pseudonyms: Pseudonyms) -> bytes:
    """Return advertising or scan response data, or an inquiry response, in the same length."""
    made = b""
    while len(data) > 1 and data[0]:
        size, kind = data[0], data[1]
        value = data[2 : 1 + size]
        made += data[:2] + _redacted(kind, value, pseudonyms)
        data = data[1 + size :]
    return made + bytes(len(data))


def _redacted(kind: int, value: bytes, pseudonyms: Pseudonyms) -> bytes:
    if kind in _NAMES:
        return pseudonyms.name(value)
    if _FIXED.get(kind) == len(value):
        return value
    if (size := _SERVICES.get(kind)) and len(value) % size == 0:
        return value if size == _UUID else without_text(value)  # the robots' own UUIDs are text
    if kind in _ADDRESSES:
        whole = len(value) // 6 * 6
        made = b"".join(pseudonyms.reversed_address(value[at : at + 6]) for at in range(0, whole, 6))
        return made + bytes(len(value) - whole)
    kept = value[: _SERVICE_DATA.get(kind, 0)]
    return kept + bytes(len(value) - len(kept))
