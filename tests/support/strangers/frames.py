"""Framing for a robot: decodes a host's requests, encodes responses. Standard library only."""

from typing import Final, NamedTuple

START, END, ESCAPE = 0x8D, 0xD8, 0xAB
FLIP: Final = 0x88
"""An escaped byte is sent without these bits: 8D as AB 05, AB as AB 23, D8 as AB 50."""


class Request(NamedTuple):
    """A command as the robot heard it; ``tid`` is None where its flags leave it out."""

    flags: int
    tid: int | None
    did: int
    cid: int
    seq: int
    data: bytes


class Answer(NamedTuple):
    """What the robot is about to say; None for addresses it leaves out."""

    flags: int
    tid: int | None
    sid: int | None
    did: int
    cid: int
    seq: int
    code: int
    data: bytes


class EarV2:
    """Decodes the host's requests, however the stream is split; damaged frames are ignored."""

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> list[Request]:
        heard = []
        for byte in data:
            if byte == START:
                self._held = bytearray([START])
            elif byte == END and self._held:
                if request := _request_v2(bytes(self._held[1:])):
                    heard.append(request)
                self._held.clear()
            elif self._held:
                self._held.append(byte)
        return heard


def _request_v2(raw: bytes) -> Request | None:
    plain, index = bytearray(), 0
    while index < len(raw):
        if raw[index] == ESCAPE and index + 1 < len(raw):
            index += 1
            plain.append(raw[index] | FLIP)
        else:
            plain.append(raw[index])
        index += 1
    if len(plain) < 5 or sum(plain) & 0xFF != 0xFF:
        return None
    fields = list(plain[:-1])
    flags = fields.pop(0)
    tid = fields.pop(0) if flags & 0x10 else None
    if flags & 0x20:
        fields.pop(0)
    if len(fields) < 3:
        return None
    did, cid, seq, *data = fields
    return Request(flags, tid, did, cid, seq, bytes(data))


def answer_v2(answer: Answer, *, escape: bool = True) -> bytes:
    """Return the frame of a response; without escaping it may be broken, as from a faulty robot."""
    addresses = [byte for byte in (answer.tid, answer.sid) if byte is not None]
    head = [answer.flags, *addresses, answer.did, answer.cid, answer.seq, answer.code]
    return _framed(bytes(head) + answer.data, escape=escape)


def notification_v2(did: int, cid: int, data: bytes) -> bytes:
    """Return the frame of a notification."""
    return _framed(bytes([0x08, did, cid, 0xFF]) + data, escape=True)


def _framed(body: bytes, *, escape: bool) -> bytes:
    body += bytes([0xFF - (sum(body) & 0xFF)])
    if escape:
        special = (START, END, ESCAPE)
        body = b"".join(bytes([ESCAPE, byte & ~FLIP]) if byte in special else bytes([byte]) for byte in body)
    return bytes([START]) + body + bytes([END])


class EarV1:
    """The same for the older robots: ``FF FE|FF DID CID SEQ DLEN data CHK``."""

    def __init__(self) -> None:
        self._held = b""

    def feed(self, data: bytes) -> list[Request]:
        self._held += data
        heard = []
        while len(self._held) >= 7:
            start, second, did, cid, seq, length = self._held[:6]
            whole = 6 + max(length, 1)
            if start != 0xFF or second < 0xFC or sum(self._held[2:whole]) & 0xFF != 0xFF:
                if len(self._held) < whole and start == 0xFF:
                    break
                self._held = self._held[1:]
                continue
            heard.append(Request(second, None, did, cid, seq, self._held[6 : whole - 1]))
            self._held = self._held[whole:]
        return heard


def answer_v1(answer: Answer) -> bytes:
    """Return ``FF FF MRSP SEQ DLEN data CHK``."""
    body = bytes([answer.code, answer.seq, len(answer.data) + 1]) + answer.data
    return b"\xff\xff" + body + bytes([0xFF - (sum(body) & 0xFF)])


def notification_v1(number: int, data: bytes) -> bytes:
    """Return ``FF FE ID DLEN_hi DLEN_lo data CHK``."""
    body = bytes([number]) + (len(data) + 1).to_bytes(2, "big") + data
    return b"\xff\xfe" + body + bytes([0xFF - (sum(body) & 0xFF)])
