"""Serial lines: link type 250, which says who sent each byte, and 147, whose records are bare bytes.

From tcpdump.org: LINKTYPE_RTAC_SERIAL.
"""

from typing import Final

from sphero_probe.captures.events import Counts, Event, Line, Serial
from sphero_probe.captures.record import RTAC_SERIAL, Record

_HEAD: Final = 12
_DATA: Final = {0x01: True, 0x02: False, 0x03: True, 0x04: False}
"""Event type -> whether the bytes were sent; the other events have none of the line's bytes."""


class SerialReader:
    """Reads link types 250 and 147."""

    def __init__(self, counts: Counts) -> None:
        """Count what is passed over."""
        self._counts = counts

    def read(self, record: Record) -> list[Event]:
        """Return the bytes that a record carries."""
        data, sent = record.data, record.sent
        if record.link == RTAC_SERIAL:
            if len(data) < _HEAD:
                self._counts["serial records cut short"] += 1
                return []
            kind = data[8] & 0x7F
            if kind not in _DATA:
                return []
            sent, data = _DATA[kind], data[_HEAD:]
        return [Serial(record.time, Line(record.interface, None), sent, data)] if data else []
