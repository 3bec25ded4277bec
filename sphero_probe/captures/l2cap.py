"""Pieces of a connection to whole ATT packets: per connection and direction, never guessed.

From the Bluetooth Core Specification, volume 3, part A.
"""

from typing import Final

from sphero_probe.captures.events import Counts, Piece

ATT_CHANNEL: Final = 0x0004
_HEAD: Final = 4
_MAX_OPEN: Final = 1 << 10
_Key = tuple[int, int | None, bool | None]


class Reassembler:
    """Holds the packets that have begun; of one that lacks a part nothing is used."""

    def __init__(self, counts: Counts) -> None:
        """Count what cannot be put together."""
        self._counts = counts
        self._open: dict[_Key, bytes] = {}

    def feed(self, piece: Piece) -> tuple[bool | None, bytes] | None:
        """Take the next piece; return direction and bytes of the ATT packet that it completes, or None."""
        line, sent, held = piece.line, piece.sent, b""
        if not piece.start and sent is None:
            open_ways = [way for way in (True, False, None) if (*line, way) in self._open]
            sent = open_ways[0] if len(open_ways) == 1 else None
        key = (*line, sent)
        begun = self._open.pop(key, None)
        if piece.start:
            self._counts["packets that lack their end"] += begun is not None
        elif begun is None:
            self._counts["parts without a start"] += 1
            return None
        else:
            held = begun
        held += piece.data
        size = int.from_bytes(held[:2], "little") + _HEAD
        if len(held) < _HEAD or len(held) < size:
            if len(self._open) >= _MAX_OPEN:
                del self._open[next(iter(self._open))]
                self._counts["packets that lack their end"] += 1
            self._open[key] = held
            return None
        if len(held) > size:
            self._counts["packets longer than they say"] += 1
            return None
        return (sent, held[_HEAD:]) if int.from_bytes(held[2:4], "little") == ATT_CHANNEL else None

    def close(self, interface: int, handle: int | None) -> None:
        """Forget what had begun on a connection that ended."""
        for way in (True, False, None):
            begun = self._open.pop((interface, handle, way), None)
            self._counts["packets that lack their end"] += begun is not None
