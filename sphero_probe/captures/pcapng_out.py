"""Writing pcapng, block by block: what is written so far is a whole file at any moment.

From the IETF draft "PCAP Next Generation (pcapng) Capture File Format".
"""

from struct import pack
from typing import Final

from sphero_probe.captures.record import Record

_SECTION, _INTERFACE, _PACKET = 0x0A0D0D0A, 1, 6
_ORDER_MARK: Final = 0x1A2B3C4D
_END, _FLAGS, _APPLICATION, _RESOLUTION = 0, 2, 4, 9
_NANOSECONDS: Final = 9
_INBOUND, _OUTBOUND = 1, 2


def head(application: str, *links: int) -> bytes:
    """Return the start of a file, with an interface for each link type."""
    return section(application) + b"".join(map(interface, links))


def section(application: str) -> bytes:
    """Return the first block of a file; ``application`` is what writes it."""
    start = pack("<IHHq", _ORDER_MARK, 1, 0, -1)
    return _block(_SECTION, start + _options((_APPLICATION, application.encode())))


def interface(link: int) -> bytes:
    """Return the block of the next interface, whose times are nanoseconds; ``link`` is its link type."""
    resolution = _options((_RESOLUTION, bytes((_NANOSECONDS,))))
    return _block(_INTERFACE, pack("<HHI", link, 0, 0) + resolution)


def packet(record: Record) -> bytes:
    """Return the block of a packet; a record without a time gets 0."""
    time = max(0, record.time or 0)
    size = len(record.data)
    body = pack("<IIIII", record.interface, time >> 32 & 0xFFFFFFFF, time & 0xFFFFFFFF, size, size) + _padded(
        record.data
    )
    if record.sent is None:
        return _block(_PACKET, body)
    flags = pack("<I", _OUTBOUND if record.sent else _INBOUND)
    return _block(_PACKET, body + _options((_FLAGS, flags)))


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _options(*options: tuple[int, bytes]) -> bytes:
    written = b"".join(pack("<HH", code, len(data)) + _padded(data) for code, data in options)
    return written + pack("<HH", _END, 0) if options else b""


def _block(kind: int, body: bytes) -> bytes:
    size = pack("<I", len(body) + 12)
    return pack("<I", kind) + size + body + size
