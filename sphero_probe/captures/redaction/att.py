"""The ATT packets of one robot without what identifies: discovery and Sphero's characteristics are kept.

Every other value becomes zeros, except for the device name. From the Bluetooth Core Specification, volume 3,
part F.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from sphero_probe.captures.att import Attributes
from sphero_probe.captures.redaction.frames import FrameStream
from sphero_probe.captures.redaction.pseudonyms import Pseudonyms, without_text
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.catalogue.gatt import PROFILES
from sphero_probe.protocol.packets import Generation

Channels = Mapping[tuple[int | None, bool | None], Generation]
"""(handle, whether values go to the robot) -> the protocol; the handle is None on a serial line."""
Settle = Callable[[bytes | None], None]
"""Takes what stands for a packet, None where it is left out."""

_KEPT: Final = {
    **dict.fromkeys((0x13, 0x19, 0x1E), (1,)),
    **dict.fromkeys((0x02, 0x03, 0x0A), (3,)),
    **dict.fromkeys((0x01, 0x04, 0x0C), (5,)),
    **dict.fromkeys((0x08, 0x10), (7,)),
}
"""Opcode of a packet that is kept -> the lengths that it has."""
_LISTS: Final = {0x05: {1: 4, 2: 18}, 0x11: {6: 6, 20: 20}}
"""Opcode of a list of UUIDs -> its first byte -> the width of a row."""
_HANDLES: Final = 0x07
_SHORT_ROW: Final = 8
"""Bytes of the longest row without a UUID of 16 bytes."""
_TYPES: Final = frozenset({0x08, 0x10})
_LONG_REQUEST: Final = 21
"""Bytes of a request for attributes of a type of 16 bytes."""
_BASE: Final = bytes.fromhex("fb349b5f80000080001000")
"""With what a UUID on Bluetooth's own base begins, on the wire."""
_FIND_VALUE, _BY_TYPE, _BY_TYPE_ANSWER, _READ, _READ_ANSWER = 0x06, 0x08, 0x09, 0x0A, 0x0B
_BLANKED: Final = frozenset({0x0D, 0x0F, 0x21})
"""Answers to reads of long values and of several values."""
_PREPARE, _PREPARED, _EXECUTE, _TELL_MANY = 0x16, 0x17, 0x18, 0x23
_WRITES, _TELLS = frozenset({0x12, 0x52}), frozenset({0x1B, 0x1D})
_DECLARATIONS: Final = {0x2800: (4, 18), 0x2801: (4, 18), 0x2802: (6, 8), 0x2803: (7, 21)}
"""Type of a declaration -> the widths of its rows: a handle, and the value."""
_DEVICE_NAME: Final = 0x2A00
_NAME_UUID: Final = "00002a00-0000-1000-8000-00805f9b34fb"
_CONFIGURATIONS: Final = frozenset({b"\0\0", b"\1\0", b"\2\0"})
"""What switches notifications and indications."""
_UNLOCK: Final = frozenset(uuid for profile in PROFILES for uuid, _ in profile.unlock)
_MAX_PREPARED: Final = 256


class RobotAtt:
    """One connection with a robot."""

    def __init__(self, channels: Channels, pseudonyms: Pseudonyms) -> None:
        """Know which characteristics carry frames; the rest follows from the packets."""
        context = CaptureContext()
        self._streams = {
            (handle, to_robot): FrameStream(generation, to_robot, context, pseudonyms)
            for (handle, to_robot), generation in channels.items()
        }
        self._pseudonyms = pseudonyms
        self._attributes = Attributes()
        self._asked: dict[bool | None, int] = {}
        self._reads: dict[bool | None, int] = {}
        self._prepared: list[tuple[bytes, Settle]] = []

    def serial(self, sent: bool | None, data: bytes, settle: Settle) -> None:
        """Take the next bytes of a serial line."""
        if stream := self._streams.get((None, sent)):
            stream.feed(data, settle)
        else:
            settle(None)

    def feed(self, sent: bool | None, packet: bytes, settle: Settle) -> None:
        """Take the next packet; ``settle`` gets what stands for it, now or later."""
        values = list(self._attributes.feed(sent, packet))
        opcode, body = packet[:1], packet[1:]
        code = opcode[0] if opcode else 0
        peer = None if sent is None else not sent
        handle = int.from_bytes(body[:2], "little")
        if code == _BY_TYPE:
            self._asked[sent] = int.from_bytes(body[4:6], "little") if len(body) == 6 else 0
        elif code == _READ:
            self._reads[sent] = handle
        if code in _KEPT or code in _LISTS or code == _HANDLES:
            settle(_discovery(packet))
        elif code in _WRITES | _TELLS:
            self._value(code in _WRITES, sent, packet, settle)
        elif code == _TELL_MANY:
            self._many(packet, settle)
        elif code in {_PREPARE, _PREPARED} and len(self._prepared) < _MAX_PREPARED:
            self._prepared.append((packet, settle))
        elif code == _EXECUTE:
            settle(packet)
            self._execute({value.handle: value.data for value in values})
        elif code == _BY_TYPE_ANSWER:
            settle(packet[:2] + self._rows(self._asked.pop(peer, 0), packet[1:2], packet[2:]))
        elif code == _READ_ANSWER:
            uuid = self._attributes.uuids.get((sent, self._reads.pop(peer, 0)))
            settle(opcode + (self._pseudonyms.name(body) if uuid == _NAME_UUID else bytes(len(body))))
        elif code == _FIND_VALUE:
            kept = packet if int.from_bytes(body[4:6], "little") in _DECLARATIONS else packet[:7]
            settle(kept.ljust(len(packet), b"\0"))
        elif code in _BLANKED:
            settle(opcode + bytes(len(body)))
        else:
            settle(None)

    def end(self) -> None:
        """Settle what is left at the end of the connection."""
        self._execute({})
        for stream in self._streams.values():
            stream.end()

    def _value(self, written: bool, sent: bool | None, packet: bytes, settle: Settle) -> None:
        head, value = packet[:3], packet[3:]
        handle = int.from_bytes(packet[1:3], "little")
        if stream := self._streams.get((handle, written)):
            stream.feed(value, lambda new: settle(head + new))
            return
        owner = sent if not written or sent is None else not sent
        known = value in _CONFIGURATIONS or self._attributes.uuids.get((owner, handle)) in _UNLOCK
        settle(packet if known else head + bytes(len(value)))

    def _many(self, packet: bytes, settle: Settle) -> None:
        """Settle a notification of several values once all of them are."""
        rows: list[bytes | None] = []
        handles: list[bytes] = []

        def settled(number: int, new: bytes) -> None:
            rows[number] = new
            if all(row is not None for row in rows):
                told = (
                    of + len(row or b"").to_bytes(2, "little") + (row or b"")
                    for of, row in zip(handles, rows, strict=True)
                )
                settle(packet[:1] + b"".join(told))

        body, values = packet[1:], []
        while len(body) >= 4 and len(body) >= 4 + int.from_bytes(body[2:4], "little"):
            size = int.from_bytes(body[2:4], "little")
            handles.append(body[:2])
            values.append(body[4 : 4 + size])
            body = body[4 + size :]
        if body or not values:
            settle(None)
            return
        rows += [None] * len(values)
        for number, (handle, value) in enumerate(zip(handles, values, strict=True)):
            stream = self._streams.get((int.from_bytes(handle, "little"), False))
            put = partial(settled, number)
            if stream:
                stream.feed(value, put)
            else:
                put(bytes(len(value)))

    def _execute(self, written: dict[int, bytes]) -> None:
        """Keep prepared writes that change nothing, and leave out the others."""
        prepared, self._prepared = self._prepared, []

        def settled(handle: int, data: bytes, new: bytes) -> None:
            for packet, settle in prepared:
                if int.from_bytes(packet[1:3], "little") == handle:
                    settle(packet if new == data else None)

        for handle, data in written.items():
            if stream := self._streams.get((handle, True)):
                stream.feed(data, partial(settled, handle, data))
        for packet, settle in prepared:
            handle = int.from_bytes(packet[1:3], "little")
            if handle not in written or (handle, True) not in self._streams:
                settle(None)

    def _rows(self, asked: int, size: bytes, rows: bytes) -> bytes:
        """Return the rows of an answer to a read by type: a handle and a value each."""
        width = size[0] if size else 0
        if width in _DECLARATIONS.get(asked, ()) or width < 2:
            return rows if width > _SHORT_ROW else without_text(rows)
        made = b""
        for at in range(0, len(rows), width):
            value = rows[at + 2 : at + width]
            made += rows[at : at + 2]
            made += self._pseudonyms.name(value) if asked == _DEVICE_NAME else bytes(len(value))
        return made


def _discovery(packet: bytes) -> bytes | None:
    """Return a packet of discovery, None where damage may have made it of somebody's value."""
    code, body = packet[0], packet[1:]
    if code in _KEPT:
        if code in _TYPES and len(packet) == _LONG_REQUEST and body[4:].startswith(_BASE):
            return packet
        return packet if len(packet) in _KEPT[code] else None
    head = 0 if code == _HANDLES else 1
    width = 4 if code == _HANDLES else _LISTS[code].get(body[0] if body else 0, 0)
    if not width or (len(body) - head) % width:
        return None
    return packet if width > _SHORT_ROW else packet[: 1 + head] + without_text(body[head:])
