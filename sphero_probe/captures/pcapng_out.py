"""Writing pcapng, block by block: what is written so far is a whole file at any moment.

From the IETF draft "PCAP Next Generation (pcapng) Capture File Format".
"""

from collections.abc import Iterable
from struct import pack
from typing import Final

from sphero_probe.captures.record import Record

_SECTION, _INTERFACE, _PACKET, _ENTRY = 0x0A0D0D0A, 1, 6, 9
_ORDER_MARK: Final = 0x1A2B3C4D
_END, _COMMENT, _FLAGS, _APPLICATION, _RESOLUTION = 0, 1, 2, 4, 9
_NANOSECONDS: Final = 9
_INBOUND, _OUTBOUND = 1, 2
_MAX_COMMENT: Final = 1 << 12
"""Bytes of a comment; a longer one is cut."""


class PcapngWriter:
    """Makes the blocks of one file, whose times are nanoseconds.

    Each interface of the records gets a block of its own before its first packet.
    """

    def __init__(self, application: str) -> None:
        """Name what writes the file."""
        self._application = application
        self._interfaces: dict[tuple[int, int], int] = {}

    def start(self) -> bytes:
        """Return the first block."""
        section = pack("<IHHq", _ORDER_MARK, 1, 0, -1)
        return _block(_SECTION, section + _options([(_APPLICATION, self._application.encode())]))

    def packet(self, record: Record, comments: Iterable[str] = ()) -> bytes:
        """Return the block of a packet, and before it that of its interface where it is new.

        Args:
            record: the packet; without a time it gets 0.
            comments: shown by Wireshark with the packet.
        """
        key = (record.link, record.interface)
        number, new = self._interfaces.get(key), b""
        if number is None:
            number = self._interfaces[key] = len(self._interfaces)
            resolution = _options([(_RESOLUTION, bytes((_NANOSECONDS,)))])
            new = _block(_INTERFACE, pack("<HHI", record.link, 0, 0) + resolution)
        time, size = max(0, record.time or 0), len(record.data)
        head = pack("<IIIII", number, time >> 32 & 0xFFFFFFFF, time & 0xFFFFFFFF, size, size)
        options = _comments(comments)
        if record.sent is not None:
            options.append((_FLAGS, pack("<I", _OUTBOUND if record.sent else _INBOUND)))
        return new + _block(_PACKET, head + _padded(record.data) + _options(options))

    def entry(self, time: int, text: str) -> bytes:
        """Return a block that holds no packet but a line of text, as an entry of the systemd journal.

        Wireshark shows it among the packets.

        Args:
            time: nanoseconds since 1970.
            text: the line.
        """
        fields = (
            f"__REALTIME_TIMESTAMP={time // 1000}\nMESSAGE={text}\nSYSLOG_IDENTIFIER={self._application}\n"
        )
        return _block(_ENTRY, _padded(fields.encode("utf-8", "replace")))


def _comments(comments: Iterable[str]) -> list[tuple[int, bytes]]:
    return [(_COMMENT, comment.encode("utf-8", "replace")[:_MAX_COMMENT]) for comment in comments]


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _options(options: Iterable[tuple[int, bytes]]) -> bytes:
    written = b"".join(pack("<HH", code, len(data)) + _padded(data) for code, data in options)
    return written + pack("<HH", _END, 0) if written else b""


def _block(kind: int, body: bytes) -> bytes:
    size = pack("<I", len(body) + 12)
    return pack("<I", kind) + size + body + size
