"""The project's fast decoders return the same as the simple ones of these tests, for every damaged stream.

``AGREE_STREAMS=1000000 AGREE_SEED=2 pytest tests/test_codec_agreement.py -k random`` tests more streams.
"""

import os
from collections.abc import Callable
from random import Random
from timeit import repeat

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Notification,
    Request,
    Response,
    Role,
)
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v1_frames import MAX_FRAME as V1_MAX_FRAME
from sphero_probe.protocol.v2 import V2
from sphero_probe.protocol.v2_frames import MAX_FRAME as V2_MAX_FRAME
from tests.support import reference_decoder, reference_decoder_v1
from tests.support.pieces import ValidPacket, decoded, pieces_of, valid_packets

STREAMS = int(os.environ.get("AGREE_STREAMS", "8000"))
SEED = int(os.environ.get("AGREE_SEED", "1"))
LENGTHS = (0, 0, 1, 2, 3, 5, 8, 13, 21, 40)
SPECIAL = (0x8D, 0xAB, 0xD8, 0x05, 0x23, 0x50, 0xFF, 0xFE, 0x00)


def some_bytes(random: Random, length: int) -> bytes:
    return bytes(random.choice((random.choice(SPECIAL), random.randrange(256))) for _ in range(length))


def v2_frames(random: Random, count: int) -> list[bytes]:
    """Frames of every shape: with and without addresses, extended, long, full of escapes."""
    frames = []
    for _ in range(count):
        seq, did, cid, code = some_bytes(random, 4)
        target, source = (random.choice((None, random.randrange(256))) for _ in range(2))
        payload = some_bytes(random, random.choice((*LENGTHS, *LENGTHS, 252, 300)))
        flags = random.choice((0x00, 0x08, 0x0A, 0x42, 0x1F88))
        match random.randrange(3):
            case 0:
                frames.append(
                    V2.encode_command(Command(did, cid, payload, target), seq, answer=bool(code & 1))
                )
            case 1:
                response = Response(seq, code, payload, did, cid, source, target, flags)
                frames.append(V2.encode_response(response))
            case 2:
                its = random.choice((0xFF, seq))
                notification = Notification(did, cid, payload, source, target, its, flags)
                frames.append(V2.encode_notification(notification))
    return frames


def v1_frames(random: Random, count: int) -> list[bytes]:
    """Frames of every kind, with false starts in their payloads."""
    frames = []
    for _ in range(count):
        seq, did, cid, code = some_bytes(random, 4)
        payload = some_bytes(random, random.choice(LENGTHS))
        match random.randrange(3):
            case 0:
                frames.append(V1.encode_command(Command(did, cid, payload), seq, answer=bool(code & 1)))
            case 1:
                frames.append(V1.encode_response(Response(seq, code, payload)))
            case 2:
                frames.append(V1.encode_notification(Notification(None, cid, payload)))
    return [*frames, V1.encode_response(Response(1, 0, some_bytes(random, 254)))]


def damaged_stream(random: Random, frames: list[bytes], most: int) -> bytes:
    """Frames in a row; in most streams some bytes are changed, lost, doubled or inserted."""
    stream = bytearray().join(random.choices(frames, k=random.randrange(1, most)))
    for _ in range(random.choice((0, 1, 1, 2, 5))):
        at = random.randrange(len(stream) + 1)
        match random.randrange(4):
            case 0:
                stream[at : at + 1] = bytes((random.choice(SPECIAL),))
            case 1:
                del stream[at : at + random.randrange(1, 8)]
            case 2:
                stream[at:at] = some_bytes(random, random.randrange(1, 6))
            case 3:
                stream[at:at] = stream[at // 2 : at // 2 + 12]
    return bytes(stream)


def decoded_packets(generation: Generation, role: Role, pieces: list[bytes]) -> list[ValidPacket]:
    packets = decoded(CODECS[generation], pieces, role)
    assert b"".join(map(CODECS[generation].frame_of, packets)) == b"".join(pieces)
    return valid_packets(packets)


def v2_content(packet: ValidPacket) -> tuple[bytes | int | None, ...]:
    code: int | None
    match packet:
        case Request(Command(did, cid, payload, target), seq, source, flags):
            code = None
        case Response(seq, code, payload, did, cid, source, target, flags):
            pass
        case Notification(did, cid, payload, source, target, seq, flags):
            code = None
    extension = flags >> 8 if flags & 0x80 else None
    return (flags & 0xFF, extension, target, source, did, cid, seq, code, payload)


def v1_content(packet: ValidPacket) -> tuple[str, int, tuple[int, ...], bytes]:
    match packet:
        case Request(Command(did, cid, payload), seq, _, flags):
            return (reference_decoder_v1.COMMAND, flags, (did, cid, seq), payload)
        case Response(seq, code, payload, flags=flags):
            return (reference_decoder_v1.RESPONSE, flags, (code, seq), payload)
        case Notification(_, cid, payload, flags=flags):
            return (reference_decoder_v1.ASYNC, flags, (cid,), payload)


def assert_agreement(generation: Generation, role: Role, stream: bytes, cuts: list[int]) -> int:
    pieces = pieces_of(stream, cuts)
    packets = decoded_packets(generation, role, pieces)
    if generation is Generation.V2:
        assert [*map(v2_content, packets)] == reference_decoder.frames_in(stream, V2_MAX_FRAME)
    else:
        plain = reference_decoder_v1.frames_in(stream, role.value, V1_MAX_FRAME)
        assert [*map(v1_content, packets)] == [tuple(frame)[:4] for frame in plain]
    return len(packets)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("generation", "frames", "most", "share"),
    [
        pytest.param(Generation.V2, v2_frames, 5, 2, id="v2-short"),
        pytest.param(Generation.V2, v2_frames, 30, 20, id="v2-long"),
        pytest.param(Generation.V1, v1_frames, 4, 2, id="v1"),
    ],
)
def test_on_random_damaged_streams(
    generation: Generation, frames: Callable[[Random, int], list[bytes]], most: int, share: int
) -> None:
    random = Random(f"{SEED} {generation} {most}")
    known = frames(random, 400)
    roles = tuple(Role)
    survivors = 0
    for number in range(STREAMS // share):
        stream = damaged_stream(random, known, most)
        cuts = [random.randrange(len(stream) + 1) for _ in range(random.choice((0, 0, 1, 3, 9)))]
        survivors += assert_agreement(generation, roles[number % len(roles)], stream, cuts)
    assert survivors > STREAMS // share // 2


@given(st.data(), st.sampled_from(Role), st.sampled_from(Generation))
def test_on_streams_that_hypothesis_thinks_of(
    data: st.DataObject, role: Role, generation: Generation
) -> None:
    frames = {Generation.V1: v1_frames, Generation.V2: v2_frames}[generation](Random(7), 20)
    parts = st.sampled_from(frames) | st.lists(st.sampled_from(SPECIAL), max_size=8).map(bytes)
    stream = b"".join(data.draw(st.lists(parts | st.binary(max_size=12), max_size=12)))
    cuts = data.draw(st.lists(st.integers(0, len(stream)), max_size=6))
    assert_agreement(generation, role, stream, cuts)


@pytest.mark.parametrize("length", [*range(245, 262), 510, 511, 512, 513, 1024])
def test_sums_that_adler32_cannot_tell(length: int) -> None:
    random = Random(length)
    for filling in (b"\xff", b"\xfe", b"\x00"):
        frame = bytearray(V2.encode_notification(Notification(0x18, 2, filling * length, 1, None, 0xFF, 8)))
        assert assert_agreement(Generation.V2, Role.HOST, bytes(frame), []) == 1
        async_frame = V1.encode_notification(Notification(None, 3, filling * length))
        assert decoded_packets(Generation.V1, Role.HOST, [async_frame])
        for _ in range(20):
            frame[random.randrange(8, length)] = random.choice((0x00, 0x0F, 0xF0, 0xFF))
            assert_agreement(Generation.V2, Role.HOST, bytes(frame), [])


@pytest.mark.unmeasured
def test_the_fast_decoder_is_ten_times_as_fast_as_the_simple_one() -> None:
    random = Random(3)
    stream = b"".join(
        V2.encode_notification(Notification(0x18, 2, random.randbytes(24), 1, None, 0xFF, 8))
        for _ in range(400)
    )
    assert len(V2.decoder(Role.HOST).feed(stream)) == len(reference_decoder.frames_in(stream, V2_MAX_FRAME))

    def quickest(run: Callable[[], object]) -> float:
        return min(repeat(run, number=1, repeat=3))

    ratios = [
        quickest(lambda: reference_decoder.frames_in(stream, V2_MAX_FRAME))
        / quickest(lambda: V2.decoder(Role.HOST).feed(stream))
        for _ in range(3)
    ]
    assert max(ratios) >= 10, ratios
