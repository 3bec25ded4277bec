"""Pieces of a connection to whole ATT packets: per connection and direction, never guessed.

From the Bluetooth Core Specification, volume 3, part A.
"""

from typing import Final, Generic, NamedTuple, TypeVar

from sphero_probe.captures.events import Counts, Piece

ATT_CHANNEL: Final = 0x0004
_HEAD: Final = 4
_MAX_OPEN: Final = 1 << 10
_Key = tuple[int, int | None, bool | None]
Origin = TypeVar("Origin")


class Whole(NamedTuple, Generic[Origin]):
    """A whole L2CAP packet.

    Attributes:
        sent: as in ``Piece``.
        channel: the channel id.
        data: what follows the header.
        origins: what ``feed`` was told of each of its pieces.
    """

    sent: bool | None
    channel: int
    data: bytes
    origins: tuple[Origin, ...]


class Reassembler(Generic[Origin]):
    """Holds the packets that have begun; of one that lacks a part nothing is used."""

    def __init__(self, counts: Counts) -> None:
        """Count what cannot be put together."""
        self._counts = counts
        self._open: dict[_Key, tuple[bytes, tuple[Origin, ...]]] = {}

    def feed(self, piece: Piece, origin: Origin) -> Whole[Origin] | None:
        """Take the next piece and where it is from; return the packet that it completes, or None."""
        line, sent = piece.line, piece.sent
        held = b""
        origins: tuple[Origin, ...] = (origin,)
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
            held, origins = begun[0], (*begun[1], origin)
        held += piece.data
        size = int.from_bytes(held[:2], "little") + _HEAD
        if len(held) < _HEAD or len(held) < size:
            if len(self._open) >= _MAX_OPEN:
                del self._open[next(iter(self._open))]
                self._counts["packets that lack their end"] += 1
            self._open[key] = held, origins
            return None
        if len(held) > size:
            self._counts["packets longer than they say"] += 1
            return None
        return Whole(sent, int.from_bytes(held[2:4], "little"), held[_HEAD:], origins)

    def close(self, interface: int, handle: int | None) -> None:
        """Forget what had begun on a connection that ended."""
        for way in (True, False, None):
            begun = self._open.pop((interface, handle, way), None)
            self._counts["packets that lack their end"] += begun is not None
