"""V2 framing: a body in, the escaped frame out; a stream in any cuts in, bodies and rubbish out.

Between the markers ``8D`` and ``D8`` the bytes ``8D``, ``D8`` and ``AB`` are written ``AB`` + (byte & ~0x88),
checksum included. The checksum is 0xFF less the sum of the unescaped bytes before it.
"""

from collections.abc import Callable, Iterator
from typing import Final
from zlib import adler32

from sphero_probe.protocol.packets import Malformed, Packet

SOP: Final = 0x8D
EOP: Final = 0xD8
ESC: Final = 0xAB

MAX_FRAME: Final = 4096
"""Raw bytes from SOP up to EOP that are held back at most; nothing a robot sends comes near."""

_SOP, _EOP, _ESC = bytes([SOP]), bytes([EOP]), bytes([ESC])
_ESCAPED_SOP, _ESCAPED_EOP, _ESCAPED_ESC = b"\xab\x05", b"\xab\x50", b"\xab\x23"
_ADLER_EXACT = 256  # up to here adler32's low half is 1 + sum without a modulus taken


def frame(body: bytes) -> bytes:
    """Return the frame around a body.

    Args:
        body: the unescaped bytes FLAGS..DATA.

    Returns:
        SOP, the escaped body and checksum, EOP.
    """
    checked = body + bytes((~sum(body) & 0xFF,))
    return (
        _SOP
        + checked.replace(_ESC, _ESCAPED_ESC).replace(_SOP, _ESCAPED_SOP).replace(_EOP, _ESCAPED_EOP)
        + _EOP
    )


def unframe(escaped: bytes) -> bytes | Malformed:
    """Return the unescaped bytes FLAGS..CHK of what stood between SOP and EOP, checked; or what is wrong."""
    body = escaped
    if _ESC in body:
        legal = body.count(_ESCAPED_SOP) + body.count(_ESCAPED_EOP) + body.count(_ESCAPED_ESC)
        if legal != body.count(_ESC):
            return spoilt(escaped, _illegal_escape(escaped))
        body = body.replace(_ESCAPED_SOP, _SOP).replace(_ESCAPED_EOP, _EOP).replace(_ESCAPED_ESC, _ESC)
    if (adler32(body) if len(body) <= _ADLER_EXACT else sum(body) + 1) & 0xFF:
        if not body:
            return spoilt(escaped, "empty frame")
        expected = ~sum(body[:-1]) & 0xFF
        return spoilt(escaped, f"checksum 0x{body[-1]:02x}, expected 0x{expected:02x}")
    return body


def spoilt(escaped: bytes, reason: str) -> Malformed:
    """Return the evidence of a frame, given as what stood between its markers, that is no packet."""
    return Malformed(_SOP + escaped + _EOP, reason)


class Deframer:
    """A byte stream in, packets out.

    It frames on the last SOP before each EOP, so damage around a good frame never costs it.
    """

    def __init__(self, parse: Callable[[bytes], Packet]) -> None:
        """Take what makes a packet of the escaped bytes between SOP and EOP."""
        self._parse = parse
        self._pending = b""

    def feed(self, data: bytes) -> list[Packet]:
        """Take the next bytes of the stream and return the packets that they complete."""
        if _EOP not in data:
            self._pending += data
            if _SOP not in data and len(self._pending) <= MAX_FRAME:
                return []
            return list(self._trim())
        *pieces, tail = (self._pending + data).split(_EOP)
        packets: list[Packet] = []
        parse = self._parse
        for piece in pieces:
            start = piece.rfind(_SOP)
            if start:
                if start < 0:
                    packets += _outside(piece)
                    continue
                packets += _rubbish(piece[:start])
            if len(piece) - start > MAX_FRAME:
                packets += _outside(piece[start:])
                continue
            packets.append(parse(piece[start + 1 :]))
        self._pending = tail
        if tail:
            packets += self._trim()
        return packets

    def give_up(self) -> list[Packet]:
        """Return what is held back because the line went quiet; no packet ever is."""
        held, self._pending = self._pending, b""
        if not held:
            return []
        reason = "the line went quiet inside a frame" if _SOP in held else "bytes outside a frame"
        return [Malformed(held, reason)]

    def _trim(self) -> Iterator[Malformed]:
        """Let go of all that can become no frame: what stands before the last SOP, and what grew too long."""
        start = max(self._pending.rfind(_SOP), 0)
        yield from _rubbish(self._pending[:start])
        kept = self._pending[start:]
        while len(kept) > MAX_FRAME:
            yield _rubble(kept[:MAX_FRAME])
            kept = kept[MAX_FRAME:]
        self._pending = kept


def _rubble(segment: bytes) -> Malformed:
    """One stretch of bytes without a second SOP, of which no frame can be made."""
    if segment[:1] != _SOP:
        return Malformed(segment, "bytes outside a frame")
    if len(segment) >= MAX_FRAME:
        return Malformed(segment, f"no end of frame within {MAX_FRAME} bytes")
    return Malformed(segment, "unfinished frame: another start came first")


def _rubbish(data: bytes) -> Iterator[Malformed]:
    """The bytes in front of a frame's own SOP: noise, then any number of unfinished frames."""
    noise, *unfinished = data.split(_SOP)
    for segment in (noise, *(_SOP + rest for rest in unfinished)):
        for at in range(0, len(segment), MAX_FRAME):
            yield _rubble(segment[at : at + MAX_FRAME])


def _outside(piece: bytes) -> Iterator[Malformed]:
    """A stretch up to an EOP that ends no frame: none was open, or it grew too long."""
    cuts = range(0, len(piece), MAX_FRAME) or range(1)
    for at in cuts:
        segment = piece[at : at + MAX_FRAME]
        if at == cuts[-1]:
            yield Malformed(segment + _EOP, "bytes outside a frame")
        else:
            yield _rubble(segment)


def _illegal_escape(escaped: bytes) -> str:
    at = 0
    while (at := escaped.find(_ESC, at)) >= 0 and escaped[at : at + 2] in (
        _ESCAPED_SOP,
        _ESCAPED_EOP,
        _ESCAPED_ESC,
    ):
        at += 2
    follower = escaped[at + 1 : at + 2]
    return f"illegal escape ab {follower.hex()}" if follower else "escape ab at the end of the frame"
