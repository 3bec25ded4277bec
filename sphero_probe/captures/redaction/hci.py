"""HCI commands and events without what identifies: addresses and names replaced, keys and the rest blanked.

From the Bluetooth Core Specification, volume 4, part E, section 7. A command or event that is not listed here
keeps its code and its length, and its parameters become zeros.
"""

from typing import Final, NamedTuple

from sphero_probe.captures.redaction.advertising import redacted_advertising
from sphero_probe.captures.redaction.pseudonyms import Pseudonyms, without_text


class _Kept(NamedTuple):
    """Which parameters are kept: all up to an offset, except addresses, names and other text among them.

    Attributes:
        size: bytes that are kept at most; zeros follow.
        addresses: offsets of Bluetooth addresses.
        name: offset of a name that runs to the end, None where there is none.
        advertising: offset of advertising data that run to the end, likewise.
    """

    size: int
    addresses: tuple[int, ...] = ()
    name: int | None = None
    advertising: int | None = None


_ALL: Final = 255
_NOTHING: Final = _Kept(0)
_KEPT: Final = _Kept(16)
_FIRST: Final = _Kept(_ALL, (0,))
_HANDLE: Final = _Kept(2)
_TYPED: Final = _Kept(7, (1,))
_COMMANDS: Final = {
    **dict.fromkeys((0x0405, 0x0408, 0x0409, 0x040A, 0x040C, 0x040E, 0x0419, 0x041A, 0x042B), _FIRST),
    **dict.fromkeys((0x042C, 0x042D, 0x042F, 0x0433, 0x0434, 0x0C0D, 0x0C12, 0x2005), _FIRST),
    **dict.fromkeys((0x040B, 0x040D, 0x042E, 0x0430), _Kept(6, (0,))),
    **dict.fromkeys((0x0406, 0x041B, 0x041C, 0x041D, 0x0C01, 0x0C1A, 0x2001, 0x2002, 0x200A), _KEPT),
    **dict.fromkeys((0x200B, 0x200C, 0x200E, 0x2013, 0x2014, 0x2015, 0x2016, 0x2022, 0x2024), _KEPT),
    **dict.fromkeys((0x2031, 0x2032, 0x2039, 0x2041, 0x2042), _KEPT),
    **dict.fromkeys((0x2011, 0x2012, 0x2027, 0x2028, 0x202B, 0x202C), _TYPED),
    **dict.fromkeys((0x2019, 0x201A), _HANDLE),
    0x0C13: _Kept(_ALL, name=0),
    0x2006: _Kept(_ALL, (7,)),
    0x2008: _Kept(_ALL, advertising=1),
    0x2009: _Kept(_ALL, advertising=1),
    0x200D: _Kept(_ALL, (6,)),
    0x2035: _TYPED,
    0x2036: _Kept(_ALL, (12,)),
    0x2037: _Kept(4),
    0x2038: _Kept(4),
    0x2043: _Kept(_ALL, (3,)),
    0x204E: _Kept(_ALL, (1,)),
}
"""Opcode -> what is kept of its parameters."""
_ANSWERS: Final = {
    **dict.fromkeys((0x1001, 0x1003, 0x1005, 0x2002, 0x2003, 0x2007, 0x201C, 0x2023), _KEPT),
    0x1002: _Kept(65),
    0x1009: _Kept(7, (1,)),
    0x0C14: _Kept(_ALL, name=1),
}
"""Opcode -> what is kept of what its command returns; else the status and two bytes, mostly a handle."""
_EVENTS: Final = {
    **dict.fromkeys((0x05, 0x06, 0x08, 0x0B, 0x0C, 0x0F, 0x10, 0x13, 0x14, 0x1A, 0x1B, 0x30, 0x57), _KEPT),
    **dict.fromkeys((0x04, 0x16, 0x17, 0x31, 0x32, 0x34, 0x35, 0x3D), _FIRST),
    **dict.fromkeys((0x18, 0x33, 0x3B), _Kept(6, (0,))),
    **dict.fromkeys((0x12, 0x36), _Kept(_ALL, (1,))),
    0x03: _Kept(_ALL, (3,)),
    0x07: _Kept(_ALL, (1,), name=7),
    0x2C: _Kept(_ALL, (3,)),
    0x2F: _Kept(_ALL, (1,), advertising=15),
}
"""Code -> what is kept of its parameters."""
_LE_EVENTS: Final = {
    0x03: _Kept(10),
    0x04: _Kept(12),
    0x06: _Kept(11),
    0x07: _Kept(11),
    0x0C: _Kept(6),
    0x11: _Kept(1),
    0x12: _Kept(6),
    0x14: _Kept(4),
    0x01: _Kept(_ALL, (6,)),
    0x05: _Kept(3),
    **dict.fromkeys((0x0A, 0x29), _Kept(_ALL, (6, 12, 18))),
    0x13: _Kept(_ALL, (3,)),
}
"""Subevent of the LE meta event -> what is kept; offsets count from the subevent's own byte."""
_INQUIRY: Final = frozenset({0x02, 0x22})
_COMPLETE, _LE_META = 0x0E, 0x3E
_REPORTS: Final = {0x02: (2, 8, 9, 1), 0x0D: (3, 23, 24, 0)}
"""Advertising report -> where its address, its length and its data are, and bytes after the data."""
_DIRECT: Final = 17
"""Where an extended report has the address of the device that it is for."""


def redacted_command(data: bytes, pseudonyms: Pseudonyms) -> bytes | None:
    """Return a command in the same length, None where it is not as long as it says."""
    if len(data) < 3 or len(data) != 3 + data[2]:
        return None
    kept = _COMMANDS.get(int.from_bytes(data[:2], "little"), _NOTHING)
    return data[:3] + _keep(data[3:], kept, pseudonyms)


def redacted_event(data: bytes, pseudonyms: Pseudonyms) -> bytes | None:
    """Return an event in the same length, None where it is not as long as it says."""
    if len(data) < 2 or len(data) != 2 + data[1]:
        return None
    code, body = data[0], data[2:]
    if code == _COMPLETE:
        answer = _ANSWERS.get(int.from_bytes(body[1:3], "little"), _Kept(3))
        return data[:2] + body[:3] + _keep(body[3:], answer, pseudonyms)
    if code == _LE_META and body:
        if body[0] in _REPORTS:
            return data[:2] + _reports(body, *_REPORTS[body[0]], pseudonyms)
        kept = _LE_EVENTS.get(body[0], _Kept(1))
        return data[:2] + _keep(body, kept, pseudonyms)
    kept = _EVENTS.get(code, _NOTHING)
    if code in _INQUIRY and body[:1] == b"\1":
        kept = _Kept(_ALL, (1,))
    return data[:2] + _keep(body, kept, pseudonyms)


def _keep(body: bytes, kept: _Kept, pseudonyms: Pseudonyms) -> bytes:
    held = body[: kept.size]
    made = bytearray(without_text(held))  # damage may have made another command or event of a name's
    for at in kept.addresses:
        made[at : at + 6] = pseudonyms.reversed_address(held[at : at + 6].ljust(6, b"\0"))
    if kept.name is not None:
        text, nul, _ = held[kept.name :].partition(b"\0")
        made[kept.name :] = pseudonyms.name(text) + nul
    if kept.advertising is not None:
        made[kept.advertising :] = redacted_advertising(held[kept.advertising :], pseudonyms)
    return bytes(made[: len(body)]).ljust(len(body), b"\0")


def _reports(
    body: bytes, at_address: int, at_size: int, at_data: int, after: int, pseudonyms: Pseudonyms
) -> bytes:
    """Return advertising reports; what does not end where it says becomes zeros."""
    made, rest = body[:2], body[2:]
    for _ in range(body[1] if len(body) > 1 else 0):
        end = at_data + rest[at_size] + after if len(rest) > at_size else 0
        if not at_data <= end <= len(rest):
            break
        head = bytearray(rest[:at_data])
        for at in (at_address, _DIRECT) if at_data > _DIRECT else (at_address,):
            head[at : at + 6] = pseudonyms.reversed_address(bytes(head[at : at + 6]))
        data = redacted_advertising(rest[at_data : end - after], pseudonyms)
        made += bytes(head) + data + rest[end - after : end]
        rest = rest[end:]
    return made + bytes(len(rest))
