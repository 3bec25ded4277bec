"""A slow and simple V2 decoder, to check the project's decoder against.

It shares no code with the project. It reads the stream once, one byte at a time, and is in one of three
states: outside a frame, inside one, or after an escape. An error inside a frame puts it outside.
"""

from enum import Enum, auto
from typing import NamedTuple


class Frame(NamedTuple):
    """The contents of a valid frame, in the order of the wire; None for fields that its flags leave out."""

    flags: int
    extension: int | None
    tid: int | None
    sid: int | None
    did: int
    cid: int
    seq: int
    err: int | None
    data: bytes


class State(Enum):
    OUTSIDE = auto()
    INSIDE = auto()
    ESCAPED = auto()


START, END, ESCAPE = 0x8D, 0xD8, 0xAB
MEANINGS = {0x05: 0x8D, 0x23: 0xAB, 0x50: 0xD8}


def frames_in(stream: bytes, longest: int) -> list[Frame]:
    """Return the valid frames of a stream.

    Args:
        stream: the bytes.
        longest: a frame may have this many bytes before its end marker, its start marker counted.
    """
    found = []
    state = State.OUTSIDE
    content: list[int] = []
    raw_bytes = 0
    for byte in stream:
        raw_bytes += 1
        if byte == START:
            state = State.INSIDE
            content = []
            raw_bytes = 1
        elif state is State.OUTSIDE:
            continue
        elif byte == END:
            if state is State.INSIDE:
                frame = frame_of(content)
                if frame is not None:
                    found.append(frame)
            state = State.OUTSIDE
        elif raw_bytes > longest:
            state = State.OUTSIDE
        elif state is State.ESCAPED:
            if byte in MEANINGS:
                content.append(MEANINGS[byte])
                state = State.INSIDE
            else:
                state = State.OUTSIDE
        elif byte == ESCAPE:
            state = State.ESCAPED
        else:
            content.append(byte)
    return found


def frame_of(content: list[int]) -> Frame | None:
    """Parse the unescaped bytes of a frame, FLAGS to CHK; None if they are not a frame."""
    if not content:
        return None
    total = 0
    for byte in content:
        total += byte
    if total % 256 != 0xFF:
        return None
    rest = content[:-1]
    try:
        flags = rest.pop(0)
        is_response = flags % 2 == 1
        extension = rest.pop(0) if flags >= 128 else None
        tid = rest.pop(0) if flags // 16 % 2 == 1 else None
        sid = rest.pop(0) if flags // 32 % 2 == 1 else None
        did = rest.pop(0)
        cid = rest.pop(0)
        seq = rest.pop(0)
        err = rest.pop(0) if is_response else None
    except IndexError:
        return None
    return Frame(flags, extension, tid, sid, did, cid, seq, err, bytes(rest))
