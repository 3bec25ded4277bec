"""V2 framing: builds escaped frames, and splits a stream into frames.

Between the markers ``8D`` and ``D8``, the bytes ``8D``, ``D8`` and ``AB`` are written as ``AB`` + (byte &
~0x88), also in the checksum. The checksum is 0xFF minus the sum of the unescaped bytes before it.
"""

from collections.abc import Iterator
from typing import Final
from zlib import adler32

from sphero_probe.protocol.packets import Malformed

SOP: Final = 0x8D
EOP: Final = 0xD8
ESC: Final = 0xAB

MAX_FRAME: Final = 4096
"""Most raw bytes from SOP to EOP that are buffered; robots send far shorter frames."""

_SOP, _EOP, _ESC = bytes([SOP]), bytes([EOP]), bytes([ESC])
_ESCAPED_SOP, _ESCAPED_EOP, _ESCAPED_ESC = b"\xab\x05", b"\xab\x50", b"\xab\x23"
_AFTER_SOP, _AFTER_EOP, _AFTER_ESC = 0x05, 0x50, 0x23
ADLER_EXACT: Final = 256
"""Up to this many bytes the low half of adler32 is exactly 1 + sum; it is three times as fast as sum."""
_ESCAPED: Final = {SOP: _ESCAPED_SOP, EOP: _ESCAPED_EOP, ESC: _ESCAPED_ESC}
_ENDS: Final = tuple(
    _ESCAPED.get(checksum, bytes((checksum,))) + _EOP for checksum in (-left & 0xFF for left in range(256))
)
"""Residue of a body -> the end of its frame: the escaped checksum that makes the residue 0, and EOP."""


def residue(checked: bytes) -> int:
    """Return the residue of the checksum, 0-255: 0 for the unescaped bytes FLAGS..CHK of a valid frame."""
    return (adler32(checked) if len(checked) <= ADLER_EXACT else sum(checked) + 1) & 0xFF


def frame(body: bytes) -> bytes:
    """Return the frame around a body.

    Args:
        body: the unescaped bytes FLAGS..DATA.

    Returns:
        SOP, the escaped body and checksum, EOP.
    """
    end = _ENDS[(adler32(body) if len(body) <= ADLER_EXACT else sum(body) + 1) & 0xFF]
    if ESC in body:  # must be first, because the others add escapes
        body = body.replace(_ESC, _ESCAPED_ESC)
    if SOP in body:
        body = body.replace(_SOP, _ESCAPED_SOP)
    if EOP in body:
        body = body.replace(_EOP, _ESCAPED_EOP)
    return _SOP + body + end


def unescape(escaped: bytes) -> bytes | None:
    """Return the unescaped bytes; None where an escape is illegal."""
    body = escaped
    if _AFTER_SOP in body:  # a search is cheaper than a replace
        body = body.replace(_ESCAPED_SOP, _SOP)
    if _AFTER_EOP in body:
        body = body.replace(_ESCAPED_EOP, _EOP)
    if ESC not in body:
        return body
    shorter = body.replace(_ESCAPED_ESC, _ESC)  # must be last, because it adds escapes
    return shorter if len(body) - len(shorter) == body.count(ESC) else None


def unescape_leniently(damaged: bytes) -> bytes:
    """Return damaged bytes with every legal escape undone and everything else unchanged."""
    body = damaged.replace(_ESCAPED_SOP, _SOP).replace(_ESCAPED_EOP, _EOP)
    return body.replace(_ESCAPED_ESC, _ESC)


def unframe(escaped: bytes) -> bytes | Malformed:
    """Return the unescaped bytes FLAGS..CHK between SOP and EOP if the checksum fits; else what is wrong."""
    body = unescape(escaped)
    if body is None:
        return damaged_frame(escaped, _illegal_escape(escaped))
    if residue(body):
        if not body:
            return damaged_frame(escaped, "empty frame")
        expected = ~sum(body[:-1]) & 0xFF
        return damaged_frame(escaped, f"checksum 0x{body[-1]:02x}, expected 0x{expected:02x}")
    return body


def damaged_frame(escaped: bytes, reason: str) -> Malformed:
    """Return a damaged frame, given as the bytes between its markers, as ``Malformed``."""
    return Malformed(_SOP + escaped + _EOP, reason)


def split_frames(stream: bytes) -> Iterator[bytes | Malformed]:
    """Split a stream that ends with EOP into frames; a frame begins at the last SOP before an EOP.

    Yields:
        The bytes between the markers of a frame, still escaped; bytes outside any frame as ``Malformed``.
    """
    for piece in stream.split(_EOP)[:-1]:
        start = piece.rfind(_SOP)
        if start < 0:
            yield from _outside_frames(piece)
            continue
        yield from _noise(piece[:start])
        if len(piece) - start > MAX_FRAME:
            yield from _outside_frames(piece[start:])
        else:
            yield piece[start + 1 :]


def resynchronise(held: bytes) -> tuple[list[Malformed], bytes]:
    """Drop the bytes that cannot become a frame from a buffer without an EOP.

    Returns:
        What was dropped because a later SOP follows it or it is too long, and the rest.
    """
    start = max(held.rfind(_SOP), 0)
    dropped = list(_noise(held[:start]))
    kept = held[start:]
    while len(kept) > MAX_FRAME:
        dropped.append(_unusable(kept[:MAX_FRAME]))
        kept = kept[MAX_FRAME:]
    return dropped, kept


def _unusable(segment: bytes) -> Malformed:
    """Say why a segment, with an SOP at most at its start, cannot be a frame."""
    if segment[:1] != _SOP:
        return Malformed(segment, "bytes outside a frame")
    if len(segment) >= MAX_FRAME:
        return Malformed(segment, f"no end of frame within {MAX_FRAME} bytes")
    return Malformed(segment, "unfinished frame: another start came first")


def _noise(data: bytes) -> Iterator[Malformed]:
    """The bytes before a frame's SOP: noise, then any number of unfinished frames."""
    before, *unfinished = data.split(_SOP)
    for segment in (before, *(_SOP + rest for rest in unfinished)):
        for at in range(0, len(segment), MAX_FRAME):
            yield _unusable(segment[at : at + MAX_FRAME])


def _outside_frames(piece: bytes) -> Iterator[Malformed]:
    """The bytes up to an EOP that ends no frame: none had begun, or it is too long."""
    cuts = range(0, len(piece), MAX_FRAME) or range(1)
    for at in cuts:
        segment = piece[at : at + MAX_FRAME]
        if at == cuts[-1]:
            yield Malformed(segment + _EOP, "bytes outside a frame")
        else:
            yield _unusable(segment)


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
