"""V2 framing: a body in, the escaped frame out; a stream in any cuts in, bodies and rubbish out.

Between the markers ``8D`` and ``D8`` the bytes ``8D``, ``D8`` and ``AB`` are written ``AB`` + (byte & ~0x88),
checksum included. The checksum is 0xFF less the sum of the unescaped bytes before it.
"""

from collections.abc import Iterator
from typing import Final
from zlib import adler32

from sphero_probe.protocol.packets import Malformed

SOP: Final = 0x8D
EOP: Final = 0xD8
ESC: Final = 0xAB

MAX_FRAME: Final = 4096
"""Raw bytes from SOP up to EOP that are held back at most; nothing a robot sends comes near."""

_SOP, _EOP, _ESC = bytes([SOP]), bytes([EOP]), bytes([ESC])
_ESCAPED_SOP, _ESCAPED_EOP, _ESCAPED_ESC = b"\xab\x05", b"\xab\x50", b"\xab\x23"
_AFTER_SOP, _AFTER_EOP, _AFTER_ESC = 0x05, 0x50, 0x23
ADLER_EXACT: Final = 256
"""Up to so many bytes adler32's low half is 1 + sum without a modulus taken; it is thrice as fast as sum."""
_ESCAPED: Final = {SOP: _ESCAPED_SOP, EOP: _ESCAPED_EOP, ESC: _ESCAPED_ESC}
_ENDS: Final = tuple(
    _ESCAPED.get(checksum, bytes((checksum,))) + _EOP for checksum in (-left & 0xFF for left in range(256))
)
"""How a frame ends whose body leaves a residue: the checksum that makes it 0, escaped, and EOP."""


def residue(checked: bytes) -> int:
    """Return what is left over, 0-255: 0 for the unescaped bytes FLAGS..CHK of a sound frame."""
    return (adler32(checked) if len(checked) <= ADLER_EXACT else sum(checked) + 1) & 0xFF


def frame(body: bytes) -> bytes:
    """Return the frame around a body.

    Args:
        body: the unescaped bytes FLAGS..DATA.

    Returns:
        SOP, the escaped body and checksum, EOP.
    """
    end = _ENDS[(adler32(body) if len(body) <= ADLER_EXACT else sum(body) + 1) & 0xFF]
    if ESC in body:  # first of the three, as the others bring escapes in
        body = body.replace(_ESC, _ESCAPED_ESC)
    if SOP in body:
        body = body.replace(_SOP, _ESCAPED_SOP)
    if EOP in body:
        body = body.replace(_EOP, _ESCAPED_EOP)
    return _SOP + body + end


def unescape(escaped: bytes) -> bytes | None:
    """Return the bytes that an escaped stretch stands for; None where an escape is illegal."""
    body = escaped
    if _AFTER_SOP in body:  # to look is cheaper than to replace
        body = body.replace(_ESCAPED_SOP, _SOP)
    if _AFTER_EOP in body:
        body = body.replace(_ESCAPED_EOP, _EOP)
    if ESC not in body:
        return body
    shorter = body.replace(_ESCAPED_ESC, _ESC)  # the last of the three, as it brings escapes in
    return shorter if len(body) - len(shorter) == body.count(ESC) else None


def unescape_leniently(damaged: bytes) -> bytes:
    """Return damaged bytes with every legal escape undone and everything else as it is."""
    body = damaged.replace(_ESCAPED_SOP, _SOP).replace(_ESCAPED_EOP, _EOP)
    return body.replace(_ESCAPED_ESC, _ESC)


def unframe(escaped: bytes) -> bytes | Malformed:
    """Return the unescaped bytes FLAGS..CHK of what stood between SOP and EOP, checked; or what is wrong."""
    body = unescape(escaped)
    if body is None:
        return spoilt(escaped, _illegal_escape(escaped))
    if residue(body):
        if not body:
            return spoilt(escaped, "empty frame")
        expected = ~sum(body[:-1]) & 0xFF
        return spoilt(escaped, f"checksum 0x{body[-1]:02x}, expected 0x{expected:02x}")
    return body


def spoilt(escaped: bytes, reason: str) -> Malformed:
    """Return the evidence of a frame, given as what stood between its markers, that is no packet."""
    return Malformed(_SOP + escaped + _EOP, reason)


def stretches(stream: bytes) -> Iterator[bytes | Malformed]:
    """Cut up a stream that ends with EOP: frame on the last SOP before each EOP.

    Yields:
        What stood between the markers of a frame, still escaped; as ``Malformed`` all that is in no frame.
    """
    for piece in stream.split(_EOP)[:-1]:
        start = piece.rfind(_SOP)
        if start < 0:
            yield from _outside(piece)
            continue
        yield from _noise(piece[:start])
        if len(piece) - start > MAX_FRAME:
            yield from _outside(piece[start:])
        else:
            yield piece[start + 1 :]


def let_go(held: bytes) -> tuple[list[Malformed], bytes]:
    """Part what can become no frame from bytes without an EOP: what is too old or too long, and the rest."""
    start = max(held.rfind(_SOP), 0)
    gone = list(_noise(held[:start]))
    kept = held[start:]
    while len(kept) > MAX_FRAME:
        gone.append(_rubble(kept[:MAX_FRAME]))
        kept = kept[MAX_FRAME:]
    return gone, kept


def _rubble(segment: bytes) -> Malformed:
    """One stretch of bytes without a second SOP, of which no frame can be made."""
    if segment[:1] != _SOP:
        return Malformed(segment, "bytes outside a frame")
    if len(segment) >= MAX_FRAME:
        return Malformed(segment, f"no end of frame within {MAX_FRAME} bytes")
    return Malformed(segment, "unfinished frame: another start came first")


def _noise(data: bytes) -> Iterator[Malformed]:
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
