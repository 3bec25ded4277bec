"""A V1 decoder as slow and plain as it can be: the bytes of a whole stream in, the sound frames in it out.

It knows nothing of the project's own decoder. At each place in turn it asks whether a frame begins there that
is whole and adds up. If so the search goes on behind that frame, if not one byte further on.
"""

from typing import NamedTuple

COMMAND, RESPONSE, ASYNC = "command", "response", "async"


class Frame(NamedTuple):
    """What stands in a sound frame, and where; the ids are DID CID SEQ, MRSP SEQ, or the id code."""

    kind: str
    sop2: int
    ids: tuple[int, ...]
    data: bytes
    start: int
    end: int


def frames_in(stream: bytes, listener: str, longest: int) -> list[Frame]:
    """Return the sound frames of a stream.

    Args:
        stream: the bytes.
        listener: "host", "robot" or "witness".
        longest: a frame of more bytes counts as none.
    """
    found = []
    unanswered: set[int] = set()
    place = 0
    while place < len(stream):
        candidates = []
        for kind in kinds_heard_by(listener):
            frame = frame_at(stream, place, kind)
            if frame is not None and frame.end - frame.start <= longest and is_meant(frame, listener):
                candidates.append(frame)
        if not candidates:
            place += 1
            continue
        shortest = min(frame.end for frame in candidates)
        candidates = [frame for frame in candidates if frame.end == shortest]
        chosen = candidates[0]
        if len(candidates) == 2:
            by_kind = {frame.kind: frame for frame in candidates}
            if ASYNC in by_kind:
                chosen = by_kind[ASYNC]
            elif by_kind[RESPONSE].ids[1] in unanswered:
                chosen = by_kind[RESPONSE]
            else:
                chosen = by_kind[COMMAND]
        if chosen.kind == COMMAND and chosen.sop2 % 2 == 1:
            unanswered.add(chosen.ids[2])
        if chosen.kind == RESPONSE:
            unanswered.discard(chosen.ids[1])
        found.append(chosen)
        place = chosen.end
    return found


def kinds_heard_by(listener: str) -> list[str]:
    if listener == "host":
        return [RESPONSE, ASYNC]
    if listener == "robot":
        return [COMMAND]
    return [COMMAND, RESPONSE, ASYNC]


def is_meant(frame: Frame, listener: str) -> bool:
    """A witness takes FF FE xx 00 for no command."""
    return not (listener == "witness" and frame.kind == COMMAND and frame.sop2 == 0xFE and frame.ids[1] == 0)


def frame_at(stream: bytes, place: int, kind: str) -> Frame | None:
    """Return the frame of one kind that begins at this place; None where there is none."""
    rest = list(stream[place:])
    try:
        if rest[0] != 0xFF:
            return None
        sop2 = rest[1]
        if kind == COMMAND:
            if sop2 < 0xF8:
                return None
            ids = tuple(rest[2:5])
            announced = rest[5]
            header = 6
            if announced == 0xFF and ids[:2] == (0x02, 0x47):
                announced = 0x404 + 1
        elif kind == RESPONSE:
            if sop2 != 0xFF:
                return None
            ids = tuple(rest[2:4])
            announced = rest[4]
            header = 5
        else:
            if sop2 != 0xFE:
                return None
            ids = (rest[2],)
            announced = rest[3] * 256 + rest[4]
            header = 5
        if announced == 0 or len(rest) < header + announced:
            return None
    except IndexError:
        return None
    total = 0
    for byte in rest[2 : header + announced]:
        total += byte
    if total % 256 != 0xFF:
        return None
    data = bytes(rest[header : header + announced - 1])
    return Frame(kind, sop2, ids, data, place, place + header + announced)
