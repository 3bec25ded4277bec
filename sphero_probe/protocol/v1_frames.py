"""V1 framing: a start and a body in, the frame out; a stream in any cuts in, packets and rubbish out.

A frame is ``FF SOP2``, a header that ends with a length, and as many bytes as that says. The last of them is
the checksum: 0xFF less the sum of all bytes behind SOP2. Nothing is escaped, so any two bytes of a payload
can look like a start, and only length and checksum together tell what is a frame.
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
"""Bytes of the longest frame that is waited for; an async length could announce 65 540."""
MIN_FRAME: Final = 6
"""Bytes of the shortest frame: an answer without data."""

_OUTSIDE = "bytes outside a frame"
_END = itemgetter(0)
_new = tuple.__new__  # a NamedTuple's own __new__ costs twice as much, and this is the hot path
_ADLER_EXACT = 256  # up to here adler32's low half is 1 + sum without a modulus taken


class Kind(Enum):
    """The three shapes of a V1 frame."""

    COMMAND = "command"
    RESPONSE = "response"
    NOTIFICATION = "notification"


class Layout(NamedTuple):
    """How to find the end of a frame.

    Attributes:
        kind: what the frame is.
        header: bytes from the first up to and with the length.
        length: takes the header, returns how many bytes follow it, checksum included; 0 where it is none.
    """

    kind: Kind
    header: int
    length: Callable[[bytes], int]


class _Sound(NamedTuple):
    """A whole frame: where it ends, and every kind that it fits."""

    end: int
    kinds: list[Kind]


class _Spoilt(NamedTuple):
    """No frame: where it would have ended, and what is wrong."""

    end: int
    reason: str


class _Waiting(NamedTuple):
    """Perhaps a frame: up to where bytes are needed to tell, and what is wrong with a shorter reading."""

    need: int
    shorter: _Spoilt | None = None


def frame(sop2: int, body: bytes) -> bytes:
    """Return the frame around a body.

    Args:
        sop2: the second start byte.
        body: all bytes behind it but the checksum.
    """
    return bytes((SOP1, sop2)) + body + bytes((~sum(body) & 0xFF,))


class Deframer:
    """A byte stream in, packets out: the first start with a sound frame behind it, then the next, and so on.

    A start that proves false costs no more than its first byte, so a frame inside or behind it is found. What
    is no frame comes out as ``Malformed``, the same pieces whatever way the stream was cut: noise up to the
    next start, a false frame up to the end that it announced or to the sound frame inside it. At most
    2 x ``MAX_FRAME`` bytes are held back.
    """

    def __init__(
        self,
        layouts: Mapping[int, tuple[Layout, ...]],
        parse: Callable[[list[Kind], bytes], Packet],
    ) -> None:
        """Take what begins with each SOP2, and what makes a packet of a whole frame and the kinds it fits."""
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
        return self._take(quiet=False) if len(self._pending) >= self._need else []

    def give_up(self) -> list[Packet]:
        """Return all that is held back, packets among it, because the line went quiet."""
        return self._take(quiet=True)

    def _take(self, *, quiet: bool) -> list[Packet]:
        """Return what can be told; up to ``told`` all is, from there to ``at`` stand bytes of no frame."""
        data, at, reason = self._pending, self._at, self._reason
        told, need = 0, 0
        packets: list[Packet] = []
        while True:
            if not reason:
                start = self._start.search(data, at)
                if start is None:
                    half_a_start = not quiet and data.endswith(b"\xff", told)
                    at = len(data) - half_a_start
                    whole = at if quiet else told + (at - told) // MAX_FRAME * MAX_FRAME
                    packets += _noise(data[told:whole], _OUTSIDE)
                    told = whole
                    break
                at = start.start()
                if at > told:
                    packets += _noise(data[told:at], _OUTSIDE)
                    told = at
            verdict = self._judge(data, at, len(data))
            waiting = isinstance(verdict, _Waiting)
            if isinstance(verdict, _Waiting):
                if not quiet:
                    need = verdict.need
                    break
                verdict = self._give_up_on(verdict, data, at)
                waiting = verdict.end == len(data)
            if isinstance(verdict, _Sound):
                if at > told:
                    packets += _noise(data[told:at], reason)
                packets.append(self._parse(verdict.kinds, data[at : verdict.end]))
                told = at = verdict.end
                reason = ""
                continue
            end = verdict.end
            if end == len(data) and data[-1] == SOP1 and not quiet:
                need = end + 1  # the next byte tells whether a frame begins with this one's last
                break
            reason = reason or verdict.reason
            inside = self._start_inside(data, at, end, sound_only=waiting)
            if inside is None:
                packets += _noise(data[told:end], reason)
                told = at = end
                reason = ""
            else:
                at = inside
                whole = told + (at - told) // MAX_FRAME * MAX_FRAME
                packets += _noise(data[told:whole], reason)
                told = whole
        self._pending, self._at, self._reason = data[told:], at - told, reason
        self._need = max(need - told, 0)
        return packets

    def _give_up_on(self, waiting: _Waiting, data: bytes, at: int) -> _Spoilt:
        """Say what is wrong with a frame that did not end: it did, damaged, where another one follows."""
        shorter = waiting.shorter
        if shorter and (shorter.end == len(data) or self._start.match(data, shorter.end)):
            return shorter
        missing = f"{len(data) - at} of {waiting.need - at} bytes"
        return _Spoilt(len(data), f"the line went quiet inside a frame: {missing}")

    def _judge(self, data: bytes, at: int, limit: int) -> _Sound | _Waiting | _Spoilt:
        """Tell what begins at a start, from the bytes before ``limit``; the nearest end is tried first."""
        if limit - at < MIN_FRAME:
            return _Waiting(at + MIN_FRAME)
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
            return _Spoilt(at + header, reason)
        if len(ends) > 1:
            ends.sort(key=_END)
        for end, kind in ends:
            if end > limit:
                nearest = ends[0][0]
                return _Waiting(end, _wrong_checksum(data, at, nearest) if nearest < end else None)
            if _adds_up(data[at + 2 : end]):
                fitting = [kind] if len(ends) == 1 else [other for its, other in ends if its == end]
                return _new(_Sound, (end, fitting))
        return _wrong_checksum(data, at, ends[0][0])

    def _start_inside(self, data: bytes, at: int, end: int, *, sound_only: bool) -> int | None:
        """Return the next start within a false frame that holds a frame, or reaches out of it and so may."""
        while (start := self._start.search(data, at + 1)) and (at := start.start()) < end:
            verdict = self._judge(data, at, end)
            if isinstance(verdict, _Sound) or (isinstance(verdict, _Waiting) and not sound_only):
                return at
        return None


def _wrong_checksum(data: bytes, at: int, end: int) -> _Spoilt:
    expected = ~sum(data[at + 2 : end - 1]) & 0xFF
    return _Spoilt(end, f"checksum 0x{data[end - 1]:02x}, expected 0x{expected:02x}")


def _adds_up(checked: bytes) -> bool:
    """Tell whether bytes and their checksum fit together."""
    return (adler32(checked) if len(checked) <= _ADLER_EXACT else sum(checked) + 1) & 0xFF == 0


def _noise(data: bytes, reason: str) -> Iterator[Malformed]:
    for at in range(0, len(data), MAX_FRAME):
        yield Malformed(data[at : at + MAX_FRAME], reason)
