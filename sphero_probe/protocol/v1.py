"""The V1 codec, for Sphero, SPRK, SPRK+, Ollie and BB-8.

=============  ==========================================  ============
command        ``FF SOP2 DID CID SEQ DLEN data CHK``       SOP2 F8 - FF
response       ``FF FF MRSP SEQ DLEN data CHK``
notification   ``FF FE ID DLEN_hi DLEN_lo data CHK``
=============  ==========================================  ============

DLEN counts the data and the checksum. A command that asks for no response but resets the sleep timer also
starts with ``FF FE``, so the meaning of a start depends on the decoder's role:

* A host reads responses and notifications. A robot reads commands.
* An observer tries every kind of frame that a start can begin, and takes the shortest one whose checksum
  fits. ``FF FE xx 00`` is a notification, because no known command has CID 00. Where the same bytes are both
  a valid command and a valid response (SEQ is one more than DLEN), they are the response if a command with
  that SEQ is still unanswered, otherwise the command.
"""

from operator import itemgetter
from struct import Struct
from typing import Final
from zlib import adler32

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
from sphero_probe.protocol.v1_codes import V1_CODES
from sphero_probe.protocol.v1_frames import (
    MAX_FRAME,
    MIN_FRAME,
    SOP1,
    Deframer,
    Kind,
    Layout,
    frame,
)

SOP2_ANSWER: Final = 0x01
SOP2_ACTIVITY: Final = 0x02
OPTION_NAMES: Final = ("requests_response", "resets_timeout")
"""What the option bits of a command's SOP2 are called, bit 0 first; the other bits are set."""
SOP2_COMMAND: Final = 0xFC
"""SOP2 of a command without options: the upper six bits are set."""
SOP2_RESPONSE: Final = 0xFF
SOP2_NOTIFICATION: Final = 0xFE

MAX_PAYLOAD: Final = 254
"""Longest payload that one DLEN byte can announce, which also counts the checksum."""
MAX_ASYNC_PAYLOAD: Final = MAX_FRAME - 6
"""Longest payload of a notification that a decoder waits for; the 16-bit length could announce 65 534."""
FIXED_PAYLOADS: Final[dict[tuple[int, int], int]] = {(0x02, 0x47): 0x404}
"""(DID, CID) -> payload length where DLEN 0xFF stands for a fixed length [vendor: password and soul block].

Everywhere else DLEN 0xFF is the number 255.
"""

_DLEN_FIXED = 0xFF
_OPTIONS = 0x07
_FIXED_LENGTHS = {bytes(pair): length + 1 for pair, length in FIXED_PAYLOADS.items()}
_UNLISTED = ("unlisted", Verdict.UNLISTED)


class V1Codec:
    """The codec of V1; it has no state."""

    generation = Generation.V1
    sequence_numbers = range(256)
    answers_name_commands = False  # a response repeats only SEQ
    has_addresses = False
    unchecked_flags = SOP2_COMMAND | SOP2_ANSWER | SOP2_ACTIVITY  # the checksum does not cover SOP2
    max_payload = MAX_PAYLOAD

    def encode_command(
        self, command: Command, seq: int, *, answer: bool = True, activity: bool = True
    ) -> bytes:
        """Return the frame of a command.

        Args:
            command: the command; addresses and ``only_errors`` are ignored, because V1 has none.
            seq: the sequence number, 0-255.
            answer: SOP2 bit 0; without it the robot acts but does not respond.
            activity: SOP2 bit 1, reset the inactivity timeout.

        Raises:
            ValueError: an id is out of range or the payload is longer than 254 bytes; a command in
                ``FIXED_PAYLOADS`` takes up to 253 bytes or exactly that many.
        """
        answer, activity = answer and command.options.answer, activity and command.options.activity
        sop2 = SOP2_COMMAND | (SOP2_ANSWER if answer else 0) | (SOP2_ACTIVITY if activity else 0)
        return _encode_request(sop2, command, seq)

    def encode_response(self, response: Response) -> bytes:
        """Return the frame of a response, without the ids and addresses that V1 does not send back.

        Raises:
            ValueError: a number is out of range or the payload is longer than 254 bytes.
        """
        length = _dlen(response.payload, MAX_PAYLOAD)
        return frame(SOP2_RESPONSE, bytes((response.code, response.seq, length)) + response.payload)

    def encode_notification(self, notification: Notification) -> bytes:
        """Return the frame of a notification.

        Raises:
            ValueError: there is a DID, the id is out of range or the payload is longer than 4090 bytes.
        """
        if notification.did is not None:
            raise ValueError("a V1 notification has one id, its cid: did is not needed")
        length = _dlen(notification.payload, MAX_ASYNC_PAYLOAD).to_bytes(2)
        return frame(SOP2_NOTIFICATION, bytes((notification.cid,)) + length + notification.payload)

    def frame_of(self, packet: Packet) -> bytes:
        """Return the exact bytes that a packet was decoded from."""
        match packet:
            case Malformed(raw=raw):
                return raw
            case Response():
                return self.encode_response(packet)
            case Notification():
                return self.encode_notification(packet)
            case Request(command=command, seq=seq, flags=flags):
                return _encode_request(SOP2_COMMAND & ~_OPTIONS | flags & _OPTIONS, command, seq)

    def may_answer(self, raw: bytes, command: Command, seq: int) -> bool:
        """Whether damaged bytes may be the remains of a response: they contain its sequence number."""
        del command
        at = raw.find(bytes((SOP1, SOP2_RESPONSE)))
        return at >= 0 and raw[at + 3 : at + 4] == bytes((seq,))

    def decoder(self, role: Role) -> Decoder:
        """Return a new decoder for one role."""
        if role is Role.HOST:
            return _HostDecoder(_LAYOUTS[role], _parse_frame)
        return Deframer(_LAYOUTS[role], _ObserverParser().parse if role is Role.OBSERVER else _parse_frame)

    def flag_names(self, packet: Packet) -> tuple[str, ...] | None:
        """Return the options of a command that are set in SOP2; None for every other packet."""
        if not isinstance(packet, Request):
            return None
        return tuple(name for bit, name in enumerate(OPTION_NAMES) if packet.flags & 1 << bit)

    def verdict(self, code: int) -> Verdict:
        """Return what an MRSP code means, ``UNLISTED`` for a code that is in no document."""
        return V1_CODES.get(code, _UNLISTED)[1]

    def code_name(self, code: int) -> str:
        """Return the V1 name of an MRSP code, or ``unlisted``."""
        return V1_CODES.get(code, _UNLISTED)[0]


def _encode_request(sop2: int, command: Command, seq: int) -> bytes:
    did, cid, payload, *_ = command
    fixed = FIXED_PAYLOADS.get((did, cid))
    if fixed is not None and len(payload) >= MAX_PAYLOAD:
        if len(payload) != fixed:
            raise ValueError(f"payload of {len(payload)} bytes, at most {MAX_PAYLOAD - 1} or exactly {fixed}")
        length = _DLEN_FIXED
    else:
        length = _dlen(payload, MAX_PAYLOAD)
    return frame(sop2, bytes((did, cid, seq, length)) + payload)


def _dlen(payload: bytes, most: int) -> int:
    if len(payload) > most:
        raise ValueError(f"payload of {len(payload)} bytes, at most {most}")
    return len(payload) + 1


def _command_length(header: bytes) -> int:
    length = header[5]
    return _FIXED_LENGTHS.get(header[2:4], length) if length == _DLEN_FIXED else length


def _unanswered_command_length(header: bytes) -> int:
    """As ``_command_length``, for a start that a short notification shares: CID 00 is not a command."""
    return _command_length(header) if header[3] else 0


_COMMAND = Layout(Kind.COMMAND, 6, _command_length)
_RESPONSE = Layout(Kind.RESPONSE, 5, itemgetter(4))
_NOTIFICATION = Layout(Kind.NOTIFICATION, 5, lambda header: header[3] << 8 | header[4])
_ANY_COMMAND: Final[dict[int, tuple[Layout, ...]]] = dict.fromkeys(range(0xF8, 0x100), (_COMMAND,))

_LAYOUTS: Final[dict[Role, dict[int, tuple[Layout, ...]]]] = {
    Role.HOST: {SOP2_RESPONSE: (_RESPONSE,), SOP2_NOTIFICATION: (_NOTIFICATION,)},
    Role.ROBOT: _ANY_COMMAND,
    Role.OBSERVER: _ANY_COMMAND
    | {
        SOP2_RESPONSE: (_RESPONSE, _COMMAND),
        SOP2_NOTIFICATION: (_NOTIFICATION, Layout(Kind.COMMAND, 6, _unanswered_command_length)),
    },
}

_new = tuple.__new__  # a NamedTuple's own __new__ costs twice as much, and this is the hot path


def _parse_frame(kinds: list[Kind], raw: bytes) -> Packet:
    """Return the packet of a valid frame, as the first of the kinds that match it."""
    kind = kinds[0]
    if kind is Kind.RESPONSE:
        return _new(Response, (raw[3], raw[2], raw[5:-1], None, None, None, None, SOP2_RESPONSE))
    if kind is Kind.NOTIFICATION:
        return _new(Notification, (None, raw[2], raw[5:-1], None, None, None, SOP2_NOTIFICATION))
    sop2 = raw[1]
    return _new(Request, (Command(raw[2], raw[3], raw[6:-1]), raw[4], None, sop2, bool(sop2 & SOP2_ANSWER)))


class _ObserverParser:
    """Parses frames of both directions; remembers unanswered commands, to tell a response from a command."""

    def __init__(self) -> None:
        self._unanswered: set[int] = set()

    def parse(self, kinds: list[Kind], raw: bytes) -> Packet:
        """Return the packet of a valid frame."""
        if kinds[0] is Kind.RESPONSE and len(kinds) > 1 and raw[3] not in self._unanswered:
            kinds = kinds[1:]
        packet = _parse_frame(kinds, raw)
        if isinstance(packet, Request) and packet.wants_answer:
            self._unanswered.add(packet.seq)
        elif isinstance(packet, Response):
            self._unanswered.discard(packet.seq)
        return packet


_HEADER = Struct(">H3B").unpack_from
_RESPONSE_START, _NOTIFICATION_START = SOP1 << 8 | SOP2_RESPONSE, SOP1 << 8 | SOP2_NOTIFICATION
_STARTS: Final = (_RESPONSE_START.to_bytes(2), _NOTIFICATION_START.to_bytes(2))
_FIRST_START_BYTE = bytes((SOP1,))
_MAX_FAST_DLEN = 253
"""DLEN of the longest frame on the fast path: up to here adler32 gives the exact sum."""


class _HostDecoder(Deframer):
    """A host's decoder: a fast path while valid frames follow each other, otherwise an ordinary deframer."""

    def feed(self, data: bytes) -> list[Packet]:
        """Take the next bytes of the stream and return the packets that they complete."""
        if self._at or self._reason:
            return super().feed(data)
        held = self._pending + data
        size = len(held)
        packets: list[Packet] = []
        if size < self._need:
            self._pending = held
            return packets
        at = 0
        last = size - MIN_FRAME
        while at <= last:
            start, first, second, length = _HEADER(held, at)
            if start == _NOTIFICATION_START:
                length |= second << 8
            elif start != _RESPONSE_START:
                break
            if not 0 < length <= _MAX_FAST_DLEN:
                break
            end = at + 5 + length
            if end > size:
                self._pending, self._need = held[at:], end - at
                return packets
            body = held[at + 2 : end]
            if adler32(body) & 0xFF:
                break
            if start == _NOTIFICATION_START:
                packets.append(
                    _new(Notification, (None, first, body[3:-1], None, None, None, SOP2_NOTIFICATION))
                )
            else:
                packets.append(
                    _new(Response, (second, first, body[3:-1], None, None, None, None, SOP2_RESPONSE))
                )
            at = end
        self._pending, self._need = held[at:], 0
        if at < size:
            if at > last and held[at : at + 2] in _STARTS:
                self._need = MIN_FRAME
            elif self._pending != _FIRST_START_BYTE:
                packets += self._extract(quiet=False)
        return packets


V1: Final[Codec] = V1Codec()
