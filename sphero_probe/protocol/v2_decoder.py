"""The V2 decoder: finds the packets in a stream, and reports damaged bytes.

The markers of a frame enclose ``FLAGS [EXT] [TID] [SID] DID CID SEQ [ERR] DATA CHK``.
"""

from collections.abc import Callable
from struct import Struct
from typing import Any, Final
from zlib import adler32

from sphero_probe.protocol.packets import (
    USUAL,
    Command,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Role,
)
from sphero_probe.protocol.v2_frames import (
    ADLER_EXACT,
    EOP,
    ESC,
    MAX_FRAME,
    SOP,
    damaged_frame,
    resynchronise,
    split_frames,
    unescape,
    unframe,
)

FLAG_RESPONSE: Final = 0x01
FLAG_ANSWER: Final = 0x02
FLAG_ONLY_ERRORS: Final = 0x04
FLAG_ACTIVITY: Final = 0x08
FLAG_TARGET: Final = 0x10
FLAG_SOURCE: Final = 0x20
FLAG_EXTENDED: Final = 0x80
FLAG_NAMES: Final = (
    "is_response",
    "requests_response",
    "requests_only_error_response",
    "is_activity",
    "has_target_id",
    "has_source_id",
    "reserved",
    "extended",
)
"""What each flag bit is called, bit 0 first [reference; bits 2 and 7: vendor]."""
STRUCTURE: Final = FLAG_RESPONSE | FLAG_TARGET | FLAG_SOURCE
"""The flags that say which fields a packet has."""

NOTIFICATION_SEQ: Final = 0xFF
"""SEQ of every captured notification; a response may have it too [real], so SEQ alone proves nothing."""

_ASKS = FLAG_ANSWER | FLAG_ONLY_ERRORS
_SHAPE = STRUCTURE | FLAG_EXTENDED
_START, _END, _BETWEEN = bytes((SOP,)), bytes((EOP,)), bytes((EOP, SOP))
_MANY = 16
_new = tuple.__new__  # a NamedTuple's own __new__ costs twice as much, and this is the hot path


_SHAPES: Final[dict[int, dict[int, Callable[[bytes], tuple[Any, ...]]]]] = {
    structure: {} for structure in (0x00, 0x01, 0x20, 0x21, 0x30, 0x31)
}
"""STRUCTURE bits -> length of a frame -> what unpacks its header, one number per byte, and payload."""
_OTHER, _OTHER_SOURCE, _OTHER_BOTH = _SHAPES[0x00], _SHAPES[0x20], _SHAPES[0x30]
_RESPONSE, _RESPONSE_SOURCE, _RESPONSE_BOTH = _SHAPES[0x01], _SHAPES[0x21], _SHAPES[0x31]


class V2Decoder:
    """Decodes a V2 stream, however it is split.

    A frame begins at the last SOP before an EOP, so damage around a valid frame never loses that frame. At
    most ``MAX_FRAME`` bytes are buffered.
    """

    def __init__(self, role: Role) -> None:
        """Start with an empty buffer, for one role."""
        self._role = role
        self._host, self._observer = role is Role.HOST, role is Role.OBSERVER
        self._held = _END  # an EOP, as if one came before the first byte, then the buffered bytes

    def feed(self, data: bytes) -> list[Packet]:  # noqa: PLR0915 - a call per frame would cost 10 %
        """Take the next bytes of the stream and return the packets that they complete."""
        held = self._held + data
        if EOP not in data:
            self._held = held
            if len(held) <= MAX_FRAME and (SOP not in data or held.rfind(SOP) == 1):
                return []
            return [*self._trim()]
        # In an undamaged stream each EOP is followed directly by the next SOP: split there, and each piece is
        # one frame. This loop is the hot path: it calls almost no Python code and handles only the common
        # shapes. _decode_slowly handles everything that is rare, long or damaged.
        pieces = held.split(_BETWEEN)
        before = pieces.pop(0)
        if not pieces:
            end = before.rfind(EOP)
            self._held = before[end:]
            return [*self._decode_slowly(before[1 : end + 1]), *self._trim()]
        packets = self._decode_slowly(before[1:] + _END) if before else []
        last = pieces.pop()
        least = 2 * len(pieces) + 2 + (EOP in last)
        has_strays = least < _MANY or held.count(SOP) + held.count(EOP) > least  # then check each piece
        if EOP in last:
            end = last.rfind(EOP)
            pieces.append(last[:end])
            self._held = last = last[end:]
        else:
            self._held = _BETWEEN + last
        host, observer = self._host, self._observer
        for piece in pieces:
            body = (unescape(piece) or b"") if ESC in piece else piece
            if not (adler32(body) & 0xFF or (has_strays and (SOP in piece or EOP in piece))):
                structure = body[0] & _SHAPE
                try:
                    if structure == 0x20:
                        flags, source, did, cid, seq, data = _OTHER_SOURCE[len(body)](body)
                        target = None
                    elif structure == 0x31:
                        flags, target, source, did, cid, seq, code, data = _RESPONSE_BOTH[len(body)](body)
                        packets.append(_new(Response, (seq, code, data, did, cid, source, target, flags)))
                        continue
                    elif structure == 0x30:
                        flags, target, source, did, cid, seq, data = _OTHER_BOTH[len(body)](body)
                    elif structure == 0x00:
                        flags, did, cid, seq, data = _OTHER[len(body)](body)
                        target = source = None
                    elif structure == 0x01:
                        flags, did, cid, seq, code, data = _RESPONSE[len(body)](body)
                        packets.append(_new(Response, (seq, code, data, did, cid, None, None, flags)))
                        continue
                    elif structure == 0x21:
                        flags, source, did, cid, seq, code, data = _RESPONSE_SOURCE[len(body)](body)
                        packets.append(_new(Response, (seq, code, data, did, cid, source, None, flags)))
                        continue
                    else:
                        packets += self._decode_slowly(_START + piece + _END)
                        continue
                    if host or (observer and seq == NOTIFICATION_SEQ and not flags & FLAG_ANSWER):
                        packets.append(_new(Notification, (did, cid, data, source, target, seq, flags)))
                    else:
                        command = _new(Command, (did, cid, data, target, USUAL))
                        asks = flags & _ASKS == FLAG_ANSWER
                        packets.append(_new(Request, (command, seq, source, flags, asks)))
                    continue
                except KeyError:  # the first frame of this length, or a length that no frame has
                    _learn(structure, len(body))
            packets += self._decode_slowly(_START + piece + _END)
        if SOP in last or len(last) >= MAX_FRAME:
            packets += self._trim()
        return packets

    def give_up(self) -> list[Packet]:
        """Return what is still buffered, because the line went quiet; that is never a whole packet."""
        held, self._held = self._held[1:], _END
        if not held:
            return []
        reason = "the line went quiet inside a frame" if SOP in held else "bytes outside a frame"
        return [Malformed(held, reason)]

    def _decode_slowly(self, stream: bytes) -> list[Packet]:
        """Return the packets in bytes that end with EOP, damaged or not."""
        return [
            piece if isinstance(piece, Malformed) else _packet(self._role, piece)
            for piece in split_frames(stream)
        ]

    def _trim(self) -> list[Malformed]:
        """Drop buffered bytes that cannot become a frame, and return them."""
        dropped, kept = resynchronise(self._held[1:])
        self._held = _END + kept
        return dropped


def _learn(structure: int, length: int) -> None:
    """Teach the hot path frames of a length, if they can be valid and adler32 can check them."""
    header = 4 + structure.bit_count()
    if header < length <= ADLER_EXACT:
        _SHAPES[structure][length] = Struct(f"{header}B{length - header - 1}sx").unpack


def _packet(role: Role, escaped: bytes) -> Packet:
    """Return the packet of any frame, given as the bytes between its markers; the slow path."""
    body = unframe(escaped)
    if isinstance(body, Malformed):
        return body
    flags = body[0]
    if flags & FLAG_EXTENDED and len(body) > 1:
        flags |= body[1] << 8
        body = body[:1] + body[2:]
    header = 4 + (flags & STRUCTURE).bit_count()
    if len(body) <= header:
        return damaged_frame(
            escaped, f"too short: flags 0x{body[0]:02x} want {header + 1} bytes, here are {len(body)}"
        )
    fields, payload = iter(body[1:header]), body[header:-1]
    target = next(fields) if flags & FLAG_TARGET else None
    source = next(fields) if flags & FLAG_SOURCE else None
    did, cid, seq, *code = fields
    if code:
        return Response(seq, code[0], payload, did, cid, source, target, flags)
    unsolicited = role is Role.OBSERVER and seq == NOTIFICATION_SEQ and not flags & FLAG_ANSWER
    if role is Role.HOST or unsolicited:
        return Notification(did, cid, payload, source, target, seq, flags)
    return Request(Command(did, cid, payload, target), seq, source, flags, flags & _ASKS == FLAG_ANSWER)
