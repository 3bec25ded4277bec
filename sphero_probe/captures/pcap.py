"""pcap files: microseconds or nanoseconds, either byte order [tcpdump.org: libpcap file format]."""

from collections.abc import Iterator
from struct import Struct
from typing import Final

from sphero_probe.captures.record import Record
from sphero_probe.captures.source import Source

_MICRO, _NANO = 0xA1B2C3D4, 0xA1B23C4D
MAGICS: Final = {
    magic.to_bytes(4, order): ("<" if order == "little" else ">", scale)
    for magic, scale in ((_MICRO, 1000), (_NANO, 1))
    for order in ("little", "big")
}
"""First four bytes -> byte order and nanoseconds in a unit of the second time field."""
_LINK: Final = 0xFFFF
"""The part of the link type field that is the link type; the rest is about checksums."""


def pcap_records(source: Source) -> Iterator[Record]:
    """Yield the records of a pcap file.

    Raises:
        UnreadableCaptureError: the file is cut.
    """
    head = source.take(24)
    order, scale = MAGICS[head[:4]]
    (link,) = Struct(f"{order}20xI").unpack(head)
    record = Struct(f"{order}IIII")
    while source.more():
        seconds, fraction, size, _ = record.unpack(source.take(16))
        yield Record(seconds * 1_000_000_000 + fraction * scale, link & _LINK, source.take(size))
