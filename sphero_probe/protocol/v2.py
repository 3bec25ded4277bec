"""The V2 protocol of BOLT, BOLT+, Mini, RVR and the droids: packets in, escaped frames out, and back.

A packet is ``FLAGS [EXT] [TID] [SID] DID CID SEQ [ERR] DATA CHK`` between a frame's markers.
"""

from functools import partial
from struct import Struct
from typing import Final

from sphero_probe.protocol.codec import Codec, Decoder
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Role,
    Verdict,
)
from sphero_probe.protocol.v2_frames import Deframer, frame, spoilt, unframe

FLAG_RESPONSE: Final = 0x01
FLAG_ANSWER: Final = 0x02
FLAG_ONLY_ERRORS: Final = 0x04
FLAG_ACTIVITY: Final = 0x08
FLAG_TARGET: Final = 0x10
FLAG_SOURCE: Final = 0x20
FLAG_EXTENDED: Final = 0x80

CLIENT: Final = 0x01
"""The source id that the host's end gives itself: port 0, node 1 [reference, real]."""
NOTIFICATION_SEQ: Final = 0xFF
"""SEQ of every captured notification; a response may carry it too [real], so it proves nothing alone."""
MAX_PAYLOAD: Final = 1024
"""Longest payload the encoder accepts: escaped in full it still fits ``MAX_FRAME``."""

_STRUCTURE = FLAG_RESPONSE | FLAG_TARGET | FLAG_SOURCE

_CODES: Final[dict[int, tuple[str, Verdict]]] = {
    0x00: ("success", Verdict.OK),
    0x01: ("bad device id", Verdict.NO_DEVICE),
    0x02: ("bad command id", Verdict.NO_COMMAND),
    0x03: ("not yet implemented", Verdict.NOT_IMPLEMENTED),
    0x04: ("restricted", Verdict.RESTRICTED),
    0x05: ("bad data length", Verdict.BAD_LENGTH),
    0x06: ("command failed", Verdict.FAILED),
    0x07: ("bad parameter value", Verdict.BAD_VALUE),
    0x08: ("busy", Verdict.BUSY),
    0x09: ("bad target id", Verdict.NO_TARGET),
    0x0A: ("target unavailable", Verdict.TARGET_UNAVAILABLE),
}


class V2Codec:
    """The V2 half of the seam; stateless."""

    generation = Generation.V2
    sequence_numbers = range(255)  # 0xFF is left to notifications
    max_payload = MAX_PAYLOAD

    def encode_command(
        self,
        command: Command,
        seq: int,
        *,
        answer: bool = True,
        activity: bool = True,
        only_errors: bool = False,
        source: int | None = None,
        extension: bytes = b"",
    ) -> bytes:
        """Return the frame of a command.

        Args:
            command: what to ask; its ``target`` adds TID, and SID 0x01 unless ``source`` says otherwise.
            seq: the handle, 0-255; allocate 0-254.
            answer: flag bit 1, ask for a response.
            activity: flag bit 3, reset the sleep timer.
            only_errors: flag bit 2, answer only on error; without ``answer`` robots refuse it with 0x06.
            source: the SID, also without a target.
            extension: at most one further flags byte, announced by bit 7.

        Raises:
            ValueError: an id is out of range, the payload or the extension is too long.
        """
        did, cid, payload, target = command
        flags = (
            (FLAG_ANSWER if answer else 0)
            | (FLAG_ONLY_ERRORS if only_errors else 0)
            | (FLAG_ACTIVITY if activity else 0)
        )
        if source is None and target is not None:
            source = CLIENT
        return _encode(flags, extension, (target, source), bytes((did, cid, seq)), payload)

    def encode_response(self, response: Response) -> bytes:
        """Return the frame of an answer; bits 0, 4 and 5 follow from the fields, the rest from ``flags``."""
        if response.did is None or response.cid is None:
            raise ValueError("a V2 response names its command: did and cid are needed")
        return _encode(
            (response.flags & 0xFF & ~_STRUCTURE) | FLAG_RESPONSE,
            _extension(response.flags),
            (response.target, response.source),
            bytes((response.did, response.cid, response.seq, response.code)),
            response.payload,
        )

    def encode_notification(self, notification: Notification) -> bytes:
        """Return the frame of a notification; SEQ is 0xFF where none is given."""
        if notification.did is None:
            raise ValueError("a V2 notification names its device: did is needed")
        seq = NOTIFICATION_SEQ if notification.seq is None else notification.seq
        return _encode(
            notification.flags & 0xFF & ~_STRUCTURE,
            _extension(notification.flags),
            (notification.target, notification.source),
            bytes((notification.did, notification.cid, seq)),
            notification.payload,
        )

    def frame_of(self, packet: Packet) -> bytes:
        """Return the very bytes that a decoded packet came in; there is one way only to escape a frame."""
        match packet:
            case Malformed(raw=raw):
                return raw
            case Response():
                return self.encode_response(packet)
            case Notification():
                return self.encode_notification(packet)
            case Request(command=(did, cid, payload, target), seq=seq, source=source, flags=flags):
                ids = bytes((did, cid, seq))
                kept = flags & 0xFF & ~_STRUCTURE
                return _encode(kept, _extension(flags), (target, source), ids, payload)

    def decoder(self, role: Role) -> Decoder:
        """Return a fresh decoder for one end of the line."""
        return Deframer(partial(_decode, role))

    def verdict(self, code: int) -> Verdict:
        """Return what an error code means; codes above 0x0A are ``UNLISTED``."""
        known = _CODES.get(code)
        return known[1] if known else Verdict.UNLISTED

    def code_name(self, code: int) -> str:
        """Return the vendor's name of an error code, ``unlisted`` where the table has none."""
        known = _CODES.get(code)
        return known[0] if known else "unlisted"


def _encode(
    flags: int, extension: bytes, addresses: tuple[int | None, int | None], ids: bytes, payload: bytes
) -> bytes:
    target, source = addresses
    if len(payload) > MAX_PAYLOAD:
        raise ValueError(f"payload of {len(payload)} bytes, at most {MAX_PAYLOAD}")
    if len(extension) > 1:
        raise ValueError(f"extension of {len(extension)} bytes, at most 1")
    header = b""
    flags &= ~FLAG_EXTENDED
    if extension:
        flags |= FLAG_EXTENDED
    if target is not None:
        flags |= FLAG_TARGET
        header = bytes((target,))
    if source is not None:
        flags |= FLAG_SOURCE
        header += bytes((source,))
    return frame(bytes((flags,)) + extension + header + ids + payload)


def _extension(flags: int) -> bytes:
    return bytes((flags >> 8 & 0xFF,)) if flags & FLAG_EXTENDED else b""


_new = tuple.__new__  # a NamedTuple's own __new__ costs twice as much, and this is the hot path
_SHAPES: Final = {
    structure: Struct("B" * (4 + structure.bit_count())).unpack_from
    for structure in (0x00, 0x01, 0x10, 0x11, 0x20, 0x21, 0x30, 0x31)
}


def _decode(role: Role, escaped: bytes) -> Packet:
    """Return the packet between one SOP and one EOP."""
    body = unframe(escaped)
    if isinstance(body, Malformed):
        return body
    flags = body[0]
    if flags & FLAG_EXTENDED and len(body) > 1:
        flags |= body[1] << 8
        body = body[:1] + body[2:]
    structure = flags & _STRUCTURE
    header = 4 + structure.bit_count()
    if len(body) <= header:
        return spoilt(
            escaped, f"too short: flags 0x{body[0]:02x} want {header + 1} bytes, here are {len(body)}"
        )
    return _packet(_SHAPES[structure](body), structure, flags, body[header:-1], role)


def _packet(values: tuple[int, ...], structure: int, flags: int, payload: bytes, role: Role) -> Packet:
    target: int | None = None
    source: int | None = None
    if structure & FLAG_RESPONSE:
        if structure == 0x31:
            _, target, source, did, cid, seq, code = values
        elif structure == 0x21:
            _, source, did, cid, seq, code = values
        elif structure == 0x11:
            _, target, did, cid, seq, code = values
        else:
            _, did, cid, seq, code = values
        return _new(Response, (seq, code, payload, did, cid, source, target, flags))
    if structure == 0x30:
        _, target, source, did, cid, seq = values
    elif structure == 0x20:
        _, source, did, cid, seq = values
    elif structure == 0x10:
        _, target, did, cid, seq = values
    else:
        _, did, cid, seq = values
    if role is Role.HOST or (role is Role.WITNESS and seq == NOTIFICATION_SEQ and not flags & FLAG_ANSWER):
        return _new(Notification, (did, cid, payload, source, target, seq, flags))
    wants_answer = flags & (FLAG_ANSWER | FLAG_ONLY_ERRORS) == FLAG_ANSWER
    return _new(Request, (Command(did, cid, payload, target), seq, source, flags, wants_answer))


V2: Final[Codec] = V2Codec()
