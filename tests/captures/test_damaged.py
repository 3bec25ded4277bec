"""Damaged captures: no exception, no frame that the undamaged one does not hold, bounded memory."""

import io
import random
import tracemalloc
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.captures.reader import open_capture
from sphero_probe.captures.source import Source
from sphero_probe.errors import BadInputFileError
from sphero_probe.protocol.packets import Generation, Malformed
from tests.support import capture_writers as writers
from tests.support.capture_conversation import (
    LONG,
    V1_FRAMES,
    V2_FRAMES,
    notify,
    v2_answer,
    v2_command,
    woven,
    write,
)
from tests.support.captures import CAPTURES
from tests.support.reference_decoder import frames_in


@cache
def made(kind: str) -> bytes:
    return CAPTURES[kind]()


def valid_v2(file: bytes) -> list[bytes]:
    """The V2 frames that are taken for whole."""
    try:
        capture = open_capture(Source(io.BytesIO(file)), "a file")
        found = list(capture.packets()) if capture else []
    except BadInputFileError:
        return []
    assert capture is None or capture.said
    return [
        packet.raw
        for packet in found
        if packet.generation is Generation.V2 and not isinstance(packet.packet, Malformed)
    ]


@settings(max_examples=200)
@given(
    st.sampled_from(sorted(CAPTURES)),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 40), st.binary(max_size=20)), min_size=1, max_size=5),
)
def test_damage_invents_no_frame(kind: str, cuts: list[tuple[float, int, bytes]]) -> None:
    file = made(kind)
    for place, removed, put_in in cuts:
        at = int(place * len(file))
        file = file[:at] + put_in + file[at + removed :]
    whole = [made(kind), *V2_FRAMES, *(put_in for *_, put_in in cuts)]
    made_up = set(valid_v2(file)) - set(V2_FRAMES)
    assert len(made_up) <= len(cuts)
    for frame in made_up:
        assert may_be_chance(frame, whole, seams=2 * len(cuts)), frame.hex()


def may_be_chance(frame: bytes, whole: Sequence[bytes], seams: int) -> bool:
    """Whether pieces of what was there, joined by the damage, have a checksum that fits by chance.

    An 8-bit sum cannot tell such a frame from a sound one: it fits, for example, where zeros were removed.
    """
    pieces, rest = 0, frame
    while rest:
        size = max(end for end in range(len(rest) + 1) if any(rest[:end] in one for one in whole))
        if not size:
            return False
        pieces, rest = pieces + 1, rest[size:]
    return pieces <= seams + 1 and len(frames_in(frame, len(frame))) == 1


@pytest.mark.parametrize(
    ("frame", "seams", "expected"),
    [
        ("8d390112110002000006000f8bd8", 2, True),
        pytest.param("8d390112110002000006000f8bd8", 0, False, id="not in one piece"),
        pytest.param("8d390112110002000006000f8cd8", 2, False, id="its sum does not fit"),
        pytest.param("8d390112110002000006010e8bd8", 2, False, id="not of bytes that were there"),
    ],
)
def test_a_frame_that_damage_makes_is_told_from_one_that_is_invented(
    frame: str, seams: int, *, expected: bool
) -> None:
    """The first was found by chance: two zeros of a version were removed."""
    sound = bytes.fromhex("8d390112110002000006000f00008bd8")
    assert sound in V2_FRAMES
    assert may_be_chance(bytes.fromhex(frame), [sound], seams) is expected


@pytest.mark.slow
def test_what_damage_makes_is_marked() -> None:
    """Flip and remove bytes: a frame that was not there before is marked.

    One is allowed: a changed V1 payload whose 8-bit checksum fits by chance is a frame like any other.
    """
    rng, known, unmarked = random.Random(20), {*V1_FRAMES, *V2_FRAMES}, []
    for _ in range(400):
        file = bytearray(made(rng.choice(sorted(CAPTURES))))
        for _ in range(rng.randint(1, 5)):
            at = rng.randrange(len(file))
            if rng.random() < 0.5:
                file[at] ^= 1 << rng.randrange(8)
            else:
                del file[at : at + rng.randint(1, 40)]
        with suppress(BadInputFileError):
            capture = open_capture(Source(io.BytesIO(bytes(file))), "a file")
            for packet in capture.packets() if capture else ():
                marked = packet.doubt or isinstance(packet.packet, Malformed)
                unmarked += [packet] if packet.raw not in known and not marked else []
    assert not [packet for packet in unmarked if packet.generation is Generation.V2]
    assert len(unmarked) <= 1


@given(st.binary(max_size=200), st.sampled_from(sorted(CAPTURES)))
def test_any_bytes_behind_a_start_are_read_to_an_end(data: bytes, kind: str) -> None:
    valid_v2(made(kind)[:40] + data)


class _Endless:
    """A capture that is made while it is read."""

    def __init__(self, size: int) -> None:
        self._left = size
        self._pieces = self._records()
        self._held = writers.btsnoop([])

    def _records(self) -> Iterator[bytes]:
        talk = woven([write(0x1C, v2_command(1, 0x13, 0x10)), notify(0x1C, v2_answer(1, 0x13, 0x10))])
        foreign = woven([notify(0x30 + number, LONG[1:40]) for number in range(40)])
        chunk = writers.btsnoop([*writers.hci(talk), *writers.hci(foreign, opened=False, first=0x80)])[16:]
        while True:
            yield chunk

    def read(self, size: int, /) -> bytes:
        while len(self._held) < size:
            self._held += next(self._pieces)
        given, self._held = self._held[: min(size, self._left)], self._held[size:]
        self._left -= len(given)
        return given


@pytest.mark.slow
def test_memory_does_not_grow_with_the_file() -> None:
    peaks = []
    for size in (200_000, 1_000_000):
        tracemalloc.start()
        capture = open_capture(Source(_Endless(size)), "a file")
        assert capture
        assert sum(1 for _ in capture.packets()) > size // 10_000
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] * 1.5 + 200_000
    assert peaks[1] < 8_000_000
