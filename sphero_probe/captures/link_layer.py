"""Bluetooth LE as it is on the air: which packet belongs to which connection, and which are good.

From the Bluetooth Core Specification, volume 6, part B; the headers before the packets from tcpdump.org
(LINKTYPE_BLUETOOTH_LE_LL_WITH_PHDR) and from Nordic's sniffer (``packet-nordic_ble.c`` of Wireshark).
"""

from typing import Final, NamedTuple

from sphero_probe.captures.events import (
    Closed,
    Counts,
    Event,
    Line,
    Named,
    Opened,
    Piece,
    address_text,
    advertised_name,
)
from sphero_probe.captures.record import LE_LINK_LAYER_RADIO, NORDIC_SNIFFER, Record

ENCRYPTED: Final = "packets of encrypted connections"
_ADVERTISING: Final = 0x8E89BED6
_ADV_WITH_DATA, _SCAN_ANSWER, _CONNECT = frozenset({0x0, 0x2, 0x4, 0x6}), 0x4, 0x5
_CONTINUES, _STARTS, _CONTROL = 1, 2, 3
_LL_TERMINATE, _LL_START_ENCRYPTION = 0x02, 0x05
_PDU_TYPE: Final = 0xF
"""Bits of an advertising header that hold the type."""
_OVERHEAD: Final = 9
"""Bytes of access address, header and checksum around a payload."""
_TO_PERIPHERAL, _TO_CENTRAL = 2, 3
_GAP, _SLACK, _BYTE = 150_000, 100_000, 8_000
"""Nanoseconds between packets of one connection event, how far that may be off, of a byte at 1 Mbit/s."""
_MAX_CONNECTIONS: Final = 1 << 10
_TAPS, _TOP = 0xDA6000, 0x800000
"""The polynomial of the checksum, its lowest power in the highest bit, and that bit."""


class _Packet(NamedTuple):
    sent: bool | None
    good: bool | None
    clear: bool
    body: bytes


class _Connection:
    """What is known of one connection on the air."""

    def __init__(self, seed: int | None = None) -> None:
        self.seed = seed
        self.encrypted = False
        self.last: dict[bool | None, int] = {}
        self.next_start: int | None = None
        self.sent = False

    def direction(self, time: int | None, size: int) -> bool | None:
        """Return who sent a packet, by its time: the two take turns 150 µs apart, the central first."""
        if time is None:
            return None
        answers = self.next_start is not None and abs(time - self.next_start) <= _SLACK
        self.sent = not self.sent if answers else True
        self.next_start = time + (size + 1) * _BYTE + _GAP
        return self.sent


class LinkLayerReader:
    """Reads link types 251, 256 and 272."""

    def __init__(self, counts: Counts) -> None:
        """Count what is passed over."""
        self._counts = counts
        self._connections: dict[int, _Connection] = {}

    def read(self, record: Record) -> list[Event]:
        """Return what a packet on the air says of connections."""
        packet = _unwrapped(record)
        if packet is None or len(packet.body) < _OVERHEAD - 3:
            self._counts["radio packets cut short"] += 1
            return []
        if packet.good is False:
            self._counts["radio packets with a wrong checksum"] += 1
            return []
        body = packet.body
        size = body[5]
        payload = body[6 : 6 + size]
        if len(payload) < size:
            self._counts["radio packets cut short"] += 1
            return []
        access = int.from_bytes(body[:4], "little")
        if access == _ADVERTISING:
            return self._advertising(record, body, payload)
        known = self._connections.setdefault(access, _Connection())
        if len(self._connections) > _MAX_CONNECTIONS:
            del self._connections[next(iter(self._connections))]
        sent = packet.sent
        if sent is None:
            sent = known.direction(record.time, size + _OVERHEAD)
        testable = packet.good is None and known.seed is not None and len(body) >= size + _OVERHEAD
        if testable and crc24(body[4 : 6 + size], known.seed or 0) != body[6 + size : 9 + size]:
            self._counts["radio packets with a wrong checksum"] += 1
            return []
        return self._data(record, Line(record.interface, access), known, packet._replace(sent=sent), payload)

    def _advertising(self, record: Record, body: bytes, payload: bytes) -> list[Event]:
        kind = body[4] & _PDU_TYPE
        if kind == _CONNECT and len(payload) >= 19:
            access = int.from_bytes(payload[12:16], "little")
            self._connections.pop(access, None)
            self._connections[access] = _Connection(int.from_bytes(payload[16:19], "little"))
            return [Opened(Line(record.interface, access), address_text(payload[6:12]))]
        name = advertised_name(payload[6:]) if kind in _ADV_WITH_DATA else None
        return [Named(address_text(payload[:6]), name)] if name else []

    def _data(
        self, record: Record, line: Line, known: _Connection, packet: _Packet, payload: bytes
    ) -> list[Event]:
        head = packet.body[4]
        number = head >> 3 & 1
        repeated = packet.sent is not None and known.last.get(packet.sent) == number
        known.last[packet.sent] = number
        kind = head & 3
        if repeated:
            self._counts["radio packets sent again"] += bool(payload)
            return []
        if known.encrypted and not packet.clear:
            self._counts[ENCRYPTED] += bool(payload)
            return []
        if kind == _CONTROL and payload:
            known.encrypted |= payload[0] == _LL_START_ENCRYPTION
            return [Closed(line)] if payload[0] == _LL_TERMINATE else []
        if not payload or kind not in {_CONTINUES, _STARTS}:
            return []
        return [Piece(record.time, line, packet.sent, kind == _STARTS, payload)]


def _unwrapped(record: Record) -> _Packet | None:
    data = record.data
    if record.link == NORDIC_SNIFFER:
        return _nordic(data)
    if record.link != LE_LINK_LAYER_RADIO:
        return _Packet(record.sent, None, clear=False, body=data)
    if len(data) < 10:
        return None
    flags = int.from_bytes(data[8:10], "little")
    way = flags >> 7 & 7
    sent = True if way == _TO_PERIPHERAL else False if way == _TO_CENTRAL else None
    good = bool(flags & 0x800) if flags & 0x400 else None
    return _Packet(sent, good, clear=bool(flags & 8), body=data[10:])


def _nordic(data: bytes) -> _Packet | None:
    """Take the headers of the sniffer off."""
    if len(data) < 18:
        return None
    start = 7
    if data[1] == 6 and data[3] == 1:
        pass
    elif data[3] not in {2, 3}:
        return None
    flags = data[start + 1]
    body = data[start + data[start] :]
    clear = not flags & 4 or bool(flags & 8)
    return _Packet(bool(flags & 2), bool(flags & 1), clear=clear, body=body)


def crc24(data: bytes, seed: int) -> bytes:
    """Return the checksum of a radio packet as it is on the air, for its start value."""
    return _forward(int(f"{seed:024b}"[::-1], 2), data)


def crc24_again(old: bytes, checksum: bytes, new: bytes) -> bytes:
    """Return the checksum of a packet that replaces another, with the start value that the other had.

    A wrong checksum stays wrong. The start value follows from the other packet and its checksum.
    """
    state = int.from_bytes(checksum, "little")
    for byte in reversed(old):
        for _ in range(8):
            state = (state ^ _TAPS) << 1 | 1 if state & _TOP else state << 1
        state ^= byte
    return _forward(state, new)


def _forward(state: int, data: bytes) -> bytes:
    for byte in data:
        state ^= byte
        for _ in range(8):
            state = state >> 1 ^ (_TAPS if state & 1 else 0)
    return state.to_bytes(3, "little")
