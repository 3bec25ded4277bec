"""A slow and simple V1 decoder, to check the project's decoder against.

It shares no code with the project. At each offset it checks whether a complete frame with a valid checksum
begins there. If so, the search continues after that frame, otherwise one byte later.
"""

from typing import NamedTuple

COMMAND, RESPONSE, ASYNC = "command", "response", "async"


class Frame(NamedTuple):
    """The contents of a valid frame, and its place; the ids are DID CID SEQ, MRSP SEQ, or the id code."""

    kind: str
    sop2: int
    ids: tuple[int, ...]
    data: bytes
    start: int
    end: int


def frames_in(stream: bytes, listener: str, longest: int) -> list[Frame]:
    """Return the valid frames of a stream.

    Args:
        stream: the bytes.
        listener: "host", "robot" or "observer".
        longest: the maximum length of a frame in bytes.
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
    """To an observer, FF FE xx 00 is not a command."""
    return not (listener == "observer" and frame.kind == COMMAND and frame.sop2 == 0xFE and frame.ids[1] == 0)


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
