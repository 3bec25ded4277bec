"""Apple's PacketLogger files (``.pklg``), either byte order.

From Wireshark's ``wiretap/packetlogger.c``; the format has no magic number, so its first records are tried.
"""

from collections.abc import Iterator
from struct import Struct
from typing import Final

from sphero_probe.captures.record import HCI_H4, Record
from sphero_probe.captures.source import MAX_RECORD, Source

_HEAD: Final = {order: Struct(f"{order}IIIB") for order in "<>"}
_H4_TYPES: Final = {0: (1, True), 1: (4, False), 2: (2, True), 3: (2, False)}
"""Record type -> the type byte of H4, and whether the host sent it."""
_KNOWN: Final = frozenset({*range(0x10), *range(0xF0, 0x100)})
_LEAST: Final = 9
"""Bytes that a record's length counts besides its packet."""
_TRIED: Final = 3


def packetlogger_order(source: Source) -> str | None:
    """Return the byte order if the file looks like PacketLogger's, else None."""
    return next((order for order in "<>" if _fits(source, _HEAD[order])), None)


def _fits(source: Source, head: Struct) -> bool:
    at = 0
    for number in range(_TRIED):
        start = source.peek(at + head.size)[at:]
        if len(start) < head.size:
            return number > 0
        size, seconds, micros, kind = head.unpack(start)
        if not _LEAST <= size <= MAX_RECORD // 4 or micros >= 1_000_000 or kind not in _KNOWN or not seconds:
            return False
        at += 4 + size
    return True


def packetlogger_records(source: Source, order: str) -> Iterator[Record]:
    """Yield the HCI packets of a PacketLogger file.

    Raises:
        UnreadableCaptureError: the file is cut.
    """
    while source.more():
        size, seconds, micros, kind = _HEAD[order].unpack(source.take(13))
        data = source.take(max(0, size - _LEAST))
        if kind in _H4_TYPES:
            h4, sent = _H4_TYPES[kind]
            time = seconds * 1_000_000_000 + micros * 1000
            yield Record(time, HCI_H4, bytes((h4,)) + data, 0, sent)
