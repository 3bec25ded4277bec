"""HCI packets: which piece of which connection, who is connected, who advertises what name.

From the Bluetooth Core Specification, volume 4, parts A and E; the Linux monitor from BlueZ
(``src/shared/btsnoop.h``).
"""

from collections.abc import Iterator
from typing import Final

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
from sphero_probe.captures.record import HCI_H4_DIRECTION, LINUX_MONITOR, Record

CUT_SHORT: Final = "ACL packets cut short"
_COMMAND, _ACL, _EVENT = 1, 2, 4
_SHIFT: Final = 8
_FIRST_TO_CONTROLLER, _CONTINUES, _FIRST_FLUSHABLE = 0, 1, 2
_DISCONNECTED, _CONNECTED, _LE_META = 0x05, 0x03, 0x3E
_LE_CONNECTED, _LE_ADVERTISING, _LE_EXTENDED = frozenset({0x01, 0x0A, 0x29}), 0x02, 0x0D
_HANDLE: Final = 0x0FFF
_MONITOR_TYPES: Final = {2: (_COMMAND, True), 3: (_EVENT, False), 4: (_ACL, True), 5: (_ACL, False)}
"""Opcode of the Linux monitor -> type byte of H4, and whether the host sent it."""


class HciReader:
    """Reads link types 187, 201 and 254, one after the other as they come."""

    def __init__(self, counts: Counts) -> None:
        """Count what is passed over."""
        self._counts = counts

    def read(self, record: Record) -> list[Event]:
        """Return what an HCI packet says of connections."""
        time, link, data, interface, sent = record
        if link == LINUX_MONITOR:
            kind, sent = _MONITOR_TYPES.get(int.from_bytes(data[2:4]), (0, None))
            interface, data = interface << 16 | int.from_bytes(data[:2]), data[4:]
        else:
            if link == HCI_H4_DIRECTION:
                sent, data = data[3:4] != b"\1", data[4:]
            kind, data = data[0] if data else 0, data[1:]
        try:
            if kind == _ACL:
                return self._acl(time, interface, sent, data)
            if kind == _EVENT:
                return list(_event(interface, data))
        except IndexError:
            self._counts["HCI packets cut short"] += 1
        return []

    def _acl(self, time: int | None, interface: int, sent: bool | None, data: bytes) -> list[Event]:
        word = data[0] | data[1] << 8
        size = data[2] | data[3] << 8
        boundary = word >> 12 & 3
        if size != len(data) - 4:
            self._counts[CUT_SHORT] += 1
            return []
        if sent is None and boundary != _CONTINUES:
            sent = boundary == _FIRST_TO_CONTROLLER
        return [Piece(time, Line(interface, word & _HANDLE), sent, boundary != _CONTINUES, data[4:])]


def _event(interface: int, data: bytes) -> Iterator[Event]:
    code, body = data[0], data[2:]
    if code == _DISCONNECTED and not body[0]:
        yield Closed(Line(interface, (body[1] | body[2] << 8) & _HANDLE))
    elif code == _CONNECTED and not body[0]:
        yield Opened(Line(interface, (body[1] | body[2] << 8) & _HANDLE), address_text(body[3:9]))
    elif code == _LE_META and body[0] in _LE_CONNECTED and not body[1]:
        yield Opened(Line(interface, (body[2] | body[3] << 8) & _HANDLE), address_text(body[6:12]))
    elif code == _LE_META and body[0] == _LE_ADVERTISING:
        yield from _named(body[2:], body[1], head=9)
    elif code == _LE_META and body[0] == _LE_EXTENDED:
        yield from _named(body[2:], body[1], head=24)


def _named(reports: bytes, count: int, head: int) -> Iterator[Event]:
    """Yield the names in advertising reports; ``head`` is what stands before the data in each.

    A plain report ends with a byte of signal strength, and its address follows one byte of event type; an
    extended one has two bytes of event type and the strength in its head.
    """
    extended = head > _SHIFT + 1
    at_address = 3 if extended else 2
    for _ in range(count):
        size = reports[head - 1]
        name = advertised_name(reports[head : head + size])
        if name:
            yield Named(address_text(reports[at_address : at_address + 6]), name)
        reports = reports[head + size + (not extended) :]
        if not reports:
            return
