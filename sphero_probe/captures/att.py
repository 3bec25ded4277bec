"""ATT packets of one connection: which characteristic is which handle, and the values that go to and fro.

From the Bluetooth Core Specification, volume 3, part F.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

_BASE_UUID: Final = "0000{}-0000-1000-8000-00805f9b34fb"
_CHARACTERISTIC: Final = 0x2803
_DEVICE_NAME: Final = 0x2A00
_ERROR = 0x01
_FIND_INFO_ANSWER = 0x05
_BY_TYPE, _BY_TYPE_ANSWER = 0x08, 0x09
_PREPARE, _EXECUTE = 0x16, 0x18
_WRITES: Final = frozenset({0x12, 0x52})
_TELLS: Final = frozenset({0x1B, 0x1D})
_TELL_MANY: Final = 0x23
_MAX_PREPARED: Final = 1 << 12
_MAX_HANDLES: Final = 1 << 12


class Value(NamedTuple):
    """A value that was written or notified.

    Attributes:
        owner: who has the characteristic: the capturing host (True) or its peer; None where it is not known.
        handle: the characteristic's.
        written: to the owner; else it was notified or indicated by it.
        data: the value.
    """

    owner: bool | None
    handle: int
    written: bool
    data: bytes


class Attributes:
    """One connection's ATT.

    Attributes:
        uuids: (owner, handle) -> UUID of a characteristic, as the capture tells them.
        name: what the peer gave as its device name, None before.
    """

    def __init__(self) -> None:
        """Know nothing yet."""
        self.uuids: dict[tuple[bool | None, int], str] = {}
        self.name: str | None = None
        self._asked: dict[bool | None, int] = {}
        self._prepared: dict[tuple[bool | None, int], bytes] = {}

    def feed(self, sent: bool | None, packet: bytes) -> Iterator[Value]:
        """Take the next packet and yield the values in it; what makes no sense says nothing."""
        if not packet:
            return
        opcode, body = packet[0], packet[1:]
        peer = None if sent is None else not sent
        handle = int.from_bytes(body[:2], "little")
        if opcode in _WRITES and len(body) >= 2:
            yield Value(peer, handle, written=True, data=body[2:])
        elif opcode in _TELLS and len(body) >= 2:
            yield Value(sent, handle, written=False, data=body[2:])
        elif opcode == _TELL_MANY:
            yield from _many(sent, body)
        elif opcode == _PREPARE and len(body) >= 4:
            self._prepare(peer, handle, int.from_bytes(body[2:4], "little"), body[4:])
        elif opcode == _EXECUTE:
            prepared, self._prepared = self._prepared, {}
            for (owner, written), data in prepared.items() if body[:1] == b"\1" else ():
                yield Value(owner, written, written=True, data=data)
        elif opcode == _BY_TYPE and len(body) in {6, 20}:
            self._asked[sent] = int.from_bytes(body[4:], "little")
        elif opcode == _BY_TYPE_ANSWER and body:
            self._by_type(sent, self._asked.pop(peer, None), body[0], body[1:])
        elif opcode == _FIND_INFO_ANSWER and body:
            size = 2 if body[0] == 1 else 16
            for at in range(1, len(body) - size - 1, size + 2):
                self._learn(sent, int.from_bytes(body[at : at + 2], "little"), body[at + 2 : at + 2 + size])
        elif opcode == _ERROR and body[:1] == bytes((_BY_TYPE,)):
            self._asked.pop(peer, None)

    def _by_type(self, owner: bool | None, asked: int | None, size: int, rows: bytes) -> None:
        if asked == _CHARACTERISTIC and size in {7, 21}:
            for at in range(0, len(rows) - size + 1, size):
                row = rows[at : at + size]
                self._learn(owner, int.from_bytes(row[3:5], "little"), row[5:])
        elif asked == _DEVICE_NAME and size > 2 and not owner:
            self.name = rows[2:size].decode("utf-8", "replace") or None

    def _learn(self, owner: bool | None, handle: int, uuid: bytes) -> None:
        text = uuid[::-1].hex()
        full = _BASE_UUID.format(text) if len(uuid) == 2 else text
        if len(self.uuids) < _MAX_HANDLES:
            if len(uuid) != 2:
                full = "-".join((text[:8], text[8:12], text[12:16], text[16:20], text[20:]))
            self.uuids.setdefault((owner, handle), full)

    def _prepare(self, owner: bool | None, handle: int, offset: int, data: bytes) -> None:
        held = self._prepared.get((owner, handle), b"")
        if offset == len(held) and len(held) + len(data) <= _MAX_PREPARED:
            self._prepared[owner, handle] = held + data


def _many(owner: bool | None, body: bytes) -> Iterator[Value]:
    while len(body) >= 4:
        handle, size = int.from_bytes(body[:2], "little"), int.from_bytes(body[2:4], "little")
        if len(body) < 4 + size:
            return
        yield Value(owner, handle, written=False, data=body[4 : 4 + size])
        body = body[4 + size :]
