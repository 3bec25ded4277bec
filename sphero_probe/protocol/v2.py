"""The V2 codec, for BOLT, BOLT+, Mini, RVR and the droids.

The markers of a frame enclose ``FLAGS [EXT] [TID] [SID] DID CID SEQ [ERR] DATA CHK``.
"""

from typing import Final

from sphero_probe.protocol.address import Address
from sphero_probe.protocol.codec import Codec, Decoder
from sphero_probe.protocol.packets import (
    USUAL,
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
from sphero_probe.protocol.v2_decoder import (
    FLAG_ACTIVITY,
    FLAG_ANSWER,
    FLAG_EXTENDED,
    FLAG_NAMES,
    FLAG_ONLY_ERRORS,
    FLAG_RESPONSE,
    FLAG_SOURCE,
    FLAG_TARGET,
    NOTIFICATION_SEQ,
    STRUCTURE,
    V2Decoder,
)
from sphero_probe.protocol.v2_frames import MAX_FRAME, frame, unescape_leniently

__all__ = ["CLIENT", "FLAG_ACTIVITY", "FLAG_ANSWER", "FLAG_ONLY_ERRORS", "MAX_PAYLOAD", "V2"]

CLIENT: Final = Address(0, 1).byte
"""The source address that the host uses [reference, real]."""
MAX_PAYLOAD: Final = 1024
"""Longest payload that the encoder accepts: with every byte escaped it still fits ``MAX_FRAME``."""
_HEADER: Final = 8
"""Most bytes that a response has up to its sequence number; damage there can cut the frame short."""

_USUAL = FLAG_ANSWER | FLAG_ACTIVITY
_ADDRESSED = FLAG_TARGET | FLAG_SOURCE
_ONE_BYTE = FLAG_EXTENDED - 1  # the highest flags without a second byte of them

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
    """The codec of V2; it has no state."""

    generation = Generation.V2
    sequence_numbers = range(255)  # notifications use 0xFF
    answers_name_commands = True
    has_addresses = True
    unchecked_flags = None
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
            command: the command; its ``target`` adds TID, and SID 0x01 unless ``source`` or its own
                options say otherwise.
            seq: the sequence number, 0-255; allocate 0-254.
            answer: flag bit 1, ask for a response.
            activity: flag bit 3, reset the sleep timer.
            only_errors: flag bit 2, respond only on error; without ``answer`` robots reject it with 0x06.
            source: the SID, also without a target.
            extension: at most one further flag byte, announced by bit 7.

        Raises:
            ValueError: an id is out of range, the payload or the extension is too long.
        """
        did, cid, payload, target, options = command
        flags = _USUAL
        bare = False
        if options is not USUAL:
            answer, only_errors = answer and options.answer, only_errors or options.only_errors
            activity, bare = activity and options.activity, options.without_source
            source = options.source if source is None else source
        if not answer:
            flags &= ~FLAG_ANSWER
        if not activity:
            flags &= ~FLAG_ACTIVITY
        if only_errors:
            flags |= FLAG_ONLY_ERRORS
        if len(payload) > MAX_PAYLOAD:
            raise ValueError(f"payload of {len(payload)} bytes, at most {MAX_PAYLOAD}")
        if source is None and not (extension or bare):  # the usual case
            if target is None:
                return frame(bytes((flags, did, cid, seq)) + payload)
            return frame(bytes((flags | _ADDRESSED, target, CLIENT, did, cid, seq)) + payload)
        if source is None and target is not None and not bare:
            source = CLIENT
        return _encode(flags, extension, target, source, (did, cid, seq), payload)

    def encode_response(self, response: Response) -> bytes:
        """Return the frame of a response; bits 0, 4 and 5 follow from the fields, the rest from ``flags``."""
        seq, code, payload, did, cid, source, target, flags = response
        if did is None or cid is None:
            raise ValueError("a V2 response names its command: did and cid are needed")
        is_usual = len(payload) <= MAX_PAYLOAD and not flags & FLAG_EXTENDED
        if is_usual and source is not None and target is not None:
            flags = flags & 0xFF | FLAG_RESPONSE | _ADDRESSED
            return frame(bytes((flags, target, source, did, cid, seq, code)) + payload)
        return _encode(
            (flags & 0xFF & ~STRUCTURE) | FLAG_RESPONSE,
            _extension(flags),
            target,
            source,
            (did, cid, seq, code),
            payload,
        )

    def encode_notification(self, notification: Notification) -> bytes:
        """Return the frame of a notification; SEQ is 0xFF where none is given."""
        did, cid, payload, source, target, seq, flags = notification
        if did is None:
            raise ValueError("a V2 notification names its device: did is needed")
        if seq is None:
            seq = NOTIFICATION_SEQ
        if target is None and source is not None and len(payload) <= MAX_PAYLOAD and flags <= _ONE_BYTE:
            return frame(bytes((flags & ~STRUCTURE | FLAG_SOURCE, source, did, cid, seq)) + payload)
        kept = flags & 0xFF & ~STRUCTURE
        return _encode(kept, _extension(flags), target, source, (did, cid, seq), payload)

    def frame_of(self, packet: Packet) -> bytes:
        """Return the exact bytes that a packet was decoded from; a packet has only one escaped form."""
        if isinstance(packet, Notification):  # most packets of a stream
            return self.encode_notification(packet)
        match packet:
            case Malformed(raw=raw):
                return raw
            case Response():
                return self.encode_response(packet)
            case Request(command=(did, cid, payload, target, _), seq=seq, source=source, flags=flags):
                kept = flags & 0xFF & ~STRUCTURE
                return _encode(kept, _extension(flags), target, source, (did, cid, seq), payload)

    def may_answer(self, raw: bytes, command: Command, seq: int) -> bool:
        """Whether damaged bytes may be the remains of a response: they contain its ids and number."""
        ids, held = bytes((command.did, command.cid, seq)), unescape_leniently(raw)
        return ids in held or (len(held) <= _HEADER and any(held.endswith(ids[:size]) for size in (1, 2)))

    def decoder(self, role: Role) -> Decoder:
        """Return a new decoder for one role."""
        return V2Decoder(role)

    def flag_names(self, packet: Packet) -> tuple[str, ...] | None:
        """Return the names of the flags that are set, bit 0 first; None for a malformed packet.

        A second byte of flags has no published names: its bits are ``extended_0`` and so on.
        """
        if isinstance(packet, Malformed):
            return None
        first = (name for bit, name in enumerate(FLAG_NAMES) if packet.flags & 1 << bit)
        second = (f"extended_{bit}" for bit in range(8) if packet.flags & 0x100 << bit)
        return (*first, *second)

    def verdict(self, code: int) -> Verdict:
        """Return what an error code means, ``UNLISTED`` above 0x0A."""
        known = _CODES.get(code)
        return known[1] if known else Verdict.UNLISTED

    def code_name(self, code: int) -> str:
        """Return the vendor's name of an error code, or ``unlisted``."""
        known = _CODES.get(code)
        return known[0] if known else "unlisted"


def _encode(
    flags: int,
    extension: bytes,
    target: int | None,
    source: int | None,
    ids: tuple[int, ...],
    payload: bytes,
) -> bytes:
    if len(payload) > MAX_FRAME:
        raise ValueError(f"payload of {len(payload)} bytes, at most {MAX_FRAME}")
    if len(extension) > 1:
        raise ValueError(f"extension of {len(extension)} bytes, at most 1")
    flags &= ~FLAG_EXTENDED
    if source is not None:
        flags |= FLAG_SOURCE
        ids = (source, *ids)
    if target is not None:
        flags |= FLAG_TARGET
        ids = (target, *ids)
    if extension:
        flags |= FLAG_EXTENDED
        ids = (*extension, *ids)
    return frame(bytes((flags, *ids)) + payload)


def _extension(flags: int) -> bytes:
    return bytes((flags >> 8 & 0xFF,)) if flags & FLAG_EXTENDED else b""


V2: Final[Codec] = V2Codec()
