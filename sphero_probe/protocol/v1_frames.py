"""V1 framing: builds frames, and finds the frames in a stream.

A frame is ``FF SOP2``, a header that ends with a length, and that many further bytes. The last byte is the
checksum: 0xFF minus the sum of all bytes after SOP2. Nothing is escaped, so any two bytes of a payload can
    look
like a start; only the length and the checksum together identify a frame.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from operator import itemgetter
from typing import Final, NamedTuple
from zlib import adler32

from sphero_probe.protocol.packets import Malformed, Packet

SOP1: Final = 0xFF
MAX_FRAME: Final = 4096
"""Longest frame in bytes that the decoder waits for; a notification could announce 65 540."""
MIN_FRAME: Final = 6
"""Shortest frame in bytes: a response without data."""

_OUTSIDE = "bytes outside a frame"
_END = itemgetter(0)
_new = tuple.__new__  # a NamedTuple's own __new__ costs twice as much, and this is the hot path
_ADLER_EXACT = 256  # up to this many bytes the low half of adler32 is exactly 1 + sum


class Kind(Enum):
    """The three shapes of a V1 frame."""

    COMMAND = "command"
    RESPONSE = "response"
    NOTIFICATION = "notification"


class Layout(NamedTuple):
    """How to find the end of a frame.

    Attributes:
        kind: the kind of frame.
        header: bytes from the start to the end of the length field.
        length: takes the header, returns how many bytes follow it, checksum included; 0 for an invalid
            length.
    """

    kind: Kind
    header: int
    length: Callable[[bytes], int]


class _Valid(NamedTuple):
    """A complete, valid frame: where it ends, and every kind that matches it."""

    end: int
    kinds: list[Kind]


class _Invalid(NamedTuple):
    """Not a frame: where it would have ended, and what is wrong with it."""

    end: int
    reason: str


class _Incomplete(NamedTuple):
    """Possibly a frame: the offset up to which bytes are needed, and why a shorter frame does not match."""

    need: int
    shorter: _Invalid | None = None


def frame(sop2: int, body: bytes) -> bytes:
    """Return the frame around a body.

    Args:
        sop2: the second start byte.
        body: all bytes after it, without the checksum.
    """
    return bytes((SOP1, sop2)) + body + bytes((~sum(body) & 0xFF,))


class Deframer:
    """Finds the frames of a stream, one after the other, and parses them.

    After a false start the search continues one byte later, so a frame inside or after it is found. All other
    bytes are returned as ``Malformed``, in the same pieces however the stream was split: noise up to the next
    start, an invalid frame up to its announced end or to the valid frame inside it. At most 2 x ``MAX_FRAME``
    bytes are buffered.
    """

    def __init__(
        self,
        layouts: Mapping[int, tuple[Layout, ...]],
        parse: Callable[[list[Kind], bytes], Packet],
    ) -> None:
        """Prepare an empty decoder.

        Args:
            layouts: SOP2 -> the frame layouts that it can begin.
            parse: takes the kinds that match a frame and the frame, returns the packet.
        """
        self._layouts = layouts
        self._parse = parse
        self._start = re.compile(b"\xff[" + re.escape(bytes(layouts)) + b"]")
        self._pending = b""
        self._at = 0
        self._need = 0
        self._reason = ""

    def feed(self, data: bytes) -> list[Packet]:
        """Take the next bytes of the stream and return the packets that they complete."""
        self._pending += data
        return self._extract(quiet=False) if len(self._pending) >= self._need else []

    def give_up(self) -> list[Packet]:
        """Return everything that is still buffered, because the line went quiet."""
        return self._extract(quiet=True)

    def _extract(self, *, quiet: bool) -> list[Packet]:
        """Return the packets that are certain.

        Bytes before ``reported`` are returned already; those from there to ``at`` are in no frame.
        """
        data, at, reason = self._pending, self._at, self._reason
        reported, need = 0, 0
        packets: list[Packet] = []
        while True:
            if not reason:
                start = self._start.search(data, at)
                if start is None:
                    partial_start = not quiet and data.endswith(b"\xff", reported)
                    at = len(data) - partial_start
                    upto = at if quiet else reported + (at - reported) // MAX_FRAME * MAX_FRAME
                    packets += _noise(data[reported:upto], _OUTSIDE)
                    reported = upto
                    break
                at = start.start()
                if at > reported:
                    packets += _noise(data[reported:at], _OUTSIDE)
                    reported = at
            verdict = self._check(data, at, len(data))
            waiting = isinstance(verdict, _Incomplete)
            if isinstance(verdict, _Incomplete):
                if not quiet:
                    need = verdict.need
                    break
                verdict = self._settle_incomplete(verdict, data, at)
                waiting = verdict.end == len(data)
            if isinstance(verdict, _Valid):
                if at > reported:
                    packets += _noise(data[reported:at], reason)
                packets.append(self._parse(verdict.kinds, data[at : verdict.end]))
                reported = at = verdict.end
                reason = ""
                continue
            end = verdict.end
            if end == len(data) and data[-1] == SOP1 and not quiet:
                need = end + 1  # the last byte may be the first one of the next frame
                break
            reason = reason or verdict.reason
            next_start = self._start_inside(data, at, end, valid_only=waiting)
            if next_start is None:
                packets += _noise(data[reported:end], reason)
                reported = at = end
                reason = ""
            else:
                at = next_start
                upto = reported + (at - reported) // MAX_FRAME * MAX_FRAME
                packets += _noise(data[reported:upto], reason)
                reported = upto
        self._pending, self._at, self._reason = data[reported:], at - reported, reason
        self._need = max(need - reported, 0)
        return packets

    def _settle_incomplete(self, waiting: _Incomplete, data: bytes, at: int) -> _Invalid:
        """Say why an incomplete frame is invalid: a shorter, damaged one if a start follows, else cut off."""
        shorter = waiting.shorter
        if shorter and (shorter.end == len(data) or self._start.match(data, shorter.end)):
            return shorter
        missing = f"{len(data) - at} of {waiting.need - at} bytes"
        return _Invalid(len(data), f"the line went quiet inside a frame: {missing}")

    def _check(self, data: bytes, at: int, limit: int) -> _Valid | _Incomplete | _Invalid:
        """Check what begins at a start, using the bytes before ``limit``; try the shortest frame first."""
        if limit - at < MIN_FRAME:
            return _Incomplete(at + MIN_FRAME)
        ends: list[tuple[int, Kind]] = []
        header, reason = 0, ""
        for kind, header, length in self._layouts[data[at + 1]]:
            size = header + length(data[at : at + header])
            if size == header:
                reason = "a length of 0 has no room for the checksum"
            elif size > MAX_FRAME:
                reason = f"a frame of {size} bytes, at most {MAX_FRAME} are waited for"
            else:
                ends.append((at + size, kind))
        if not ends:
            return _Invalid(at + header, reason)
        if len(ends) > 1:
            ends.sort(key=_END)
        for end, kind in ends:
            if end > limit:
                nearest = ends[0][0]
                return _Incomplete(end, _wrong_checksum(data, at, nearest) if nearest < end else None)
            if _checksum_fits(data[at + 2 : end]):
                fitting = [kind] if len(ends) == 1 else [other for its, other in ends if its == end]
                return _new(_Valid, (end, fitting))
        return _wrong_checksum(data, at, ends[0][0])

    def _start_inside(self, data: bytes, at: int, end: int, *, valid_only: bool) -> int | None:
        """Return the next start inside an invalid frame that begins a valid frame or may extend past it."""
        while (start := self._start.search(data, at + 1)) and (at := start.start()) < end:
            verdict = self._check(data, at, end)
            if isinstance(verdict, _Valid) or (isinstance(verdict, _Incomplete) and not valid_only):
                return at
        return None


def _wrong_checksum(data: bytes, at: int, end: int) -> _Invalid:
    expected = ~sum(data[at + 2 : end - 1]) & 0xFF
    return _Invalid(end, f"checksum 0x{data[end - 1]:02x}, expected 0x{expected:02x}")


def _checksum_fits(checked: bytes) -> bool:
    """Whether bytes match their checksum, the last of them."""
    return (adler32(checked) if len(checked) <= _ADLER_EXACT else sum(checked) + 1) & 0xFF == 0


def _noise(data: bytes, reason: str) -> Iterator[Malformed]:
    for at in range(0, len(data), MAX_FRAME):
        yield Malformed(data[at : at + MAX_FRAME], reason)
