"""HCI commands and events without what identifies: addresses and names replaced, keys and the rest blanked.

From the Bluetooth Core Specification, volume 4, part E, section 7. A command or event that is not listed here
keeps its code and its length, and its parameters become zeros. The sizes agree with those of BlueZ's monitor
(``monitor/packet.c``), where it has one size.
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
        of: bytes of all parameters, where there is one size; any other is another packet, made by damage.
    """

    size: int
    addresses: tuple[int, ...] = ()
    name: int | None = None
    advertising: int | None = None
    of: int | None = None


def _whole(size: int, *addresses: int) -> _Kept:
    """Keep all parameters of a packet that has this many bytes of them."""
    return _Kept(size, addresses, of=size)


_NOTHING: Final = _Kept(0)
_HANDLE: Final = _Kept(2)
_TYPED: Final = _Kept(7, (1,))
_COMMANDS: Final = {
    0x0406: _whole(3),
    0x041B: _whole(2),
    0x041C: _whole(3),
    0x041D: _whole(2),
    0x0405: _whole(13, 0),
    0x0409: _whole(7, 0),
    0x040A: _whole(7, 0),
    0x0419: _whole(10, 0),
    **dict.fromkeys((0x0408, 0x040C, 0x040E, 0x041A, 0x042C, 0x042D, 0x042F, 0x0433), _whole(6, 0)),
    0x042B: _whole(9, 0),
    0x0434: _whole(7, 0),
    0x0C0D: _whole(7, 0),
    0x0C12: _whole(7, 0),
    **dict.fromkeys((0x040B, 0x040D, 0x042E, 0x0430), _Kept(6, (0,))),
    0x0C01: _whole(8),
    0x0C1A: _whole(1),
    0x2001: _whole(8),
    0x2002: _whole(0),
    0x200A: _whole(1),
    0x200B: _whole(7),
    0x200C: _whole(2),
    0x200E: _whole(0),
    0x2013: _whole(14),
    0x2014: _whole(5),
    0x2015: _whole(2),
    0x2016: _whole(2),
    0x2022: _whole(6),
    0x2024: _whole(4),
    0x2031: _whole(3),
    0x2032: _whole(7),
    0x2039: _whole(6),
    0x2041: _whole(8),
    0x2042: _whole(6),
    **dict.fromkeys((0x2011, 0x2012, 0x2027, 0x2028, 0x202B, 0x202C), _TYPED),
    **dict.fromkeys((0x2019, 0x201A), _HANDLE),
    0x2005: _whole(6, 0),
    0x2006: _whole(15, 7),
    0x200D: _whole(25, 6),
    0x2036: _whole(25, 12),
    0x2043: _whole(26, 3),
    0x204E: _whole(8, 1),
    0x0C13: _Kept(248, name=0, of=248),
    0x2008: _Kept(32, advertising=1, of=32),
    0x2009: _Kept(32, advertising=1, of=32),
    0x2035: _TYPED,
    0x2037: _Kept(4),
    0x2038: _Kept(4),
}
"""Opcode -> what is kept of its parameters."""
_ANSWERS: Final = {
    0x1001: _whole(9),
    0x1003: _whole(9),
    0x1005: _whole(8),
    0x2002: _whole(4),
    0x2003: _whole(9),
    0x2007: _whole(2),
    0x201C: _whole(9),
    0x2023: _whole(5),
    0x1002: _whole(65),
    0x1009: _whole(7, 1),
    0x0C14: _Kept(249, name=1, of=249),
}
"""Opcode -> what is kept of what its command returns; else the status and two bytes, mostly a handle."""
_EVENTS: Final = {
    0x05: _whole(4),
    0x06: _whole(3),
    0x08: _whole(4),
    0x0B: _whole(11),
    0x0C: _whole(8),
    0x0F: _whole(4),
    0x10: _whole(1),
    0x13: _Kept(9),
    0x14: _whole(6),
    0x1A: _whole(1),
    0x1B: _whole(3),
    0x30: _whole(3),
    0x57: _whole(2),
    0x03: _whole(11, 3),
    0x04: _whole(10, 0),
    0x12: _whole(8, 1),
    0x2C: _whole(17, 3),
    **dict.fromkeys((0x16, 0x17, 0x31, 0x34, 0x35), _whole(6, 0)),
    0x32: _whole(9, 0),
    0x36: _whole(7, 1),
    0x3D: _whole(14, 0),
    **dict.fromkeys((0x18, 0x33, 0x3B), _Kept(6, (0,))),
    0x07: _Kept(255, (1,), name=7, of=255),
    0x2F: _Kept(255, (1,), advertising=15, of=255),
}
"""Code -> what is kept of its parameters."""
_LE_EVENTS: Final = {
    0x03: _whole(10),
    0x04: _whole(12),
    0x06: _whole(11),
    0x07: _whole(11),
    0x0C: _whole(6),
    0x11: _whole(1),
    0x12: _whole(6),
    0x14: _whole(4),
    0x01: _whole(19, 6),
    0x05: _Kept(3),
    0x0A: _whole(31, 6, 12, 18),
    0x29: _whole(34, 6, 12, 18),
    0x13: _whole(9, 3),
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
        kept = _whole(15, 1)
    return data[:2] + _keep(body, kept, pseudonyms)


def _keep(body: bytes, kept: _Kept, pseudonyms: Pseudonyms) -> bytes:
    held = body[: kept.size if kept.of in (None, len(body)) else 0]
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
