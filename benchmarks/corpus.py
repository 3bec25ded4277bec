"""Generates simulated traffic for the benchmarks, the same for the same seed.

Flags, addresses and lengths are those that robots use; the contents are random. Sensor values are floats or
integers of a plausible size, so bytes that must be escaped are as frequent as in real values.
"""

from collections.abc import Mapping
from random import Random
from struct import Struct
from typing import Final, NamedTuple

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Notification, Packet, Response

SEED: Final = 20261122
"""The default seed of every corpus."""

_HOST, _MAIN, _RADIO = 0x01, 0x12, 0x11
_ANSWERS: Final = (0, 0, 0, 1, 1, 2, 4, 6, 8, 12)
"""Payload lengths of responses in bytes: most only report success."""
_PAIRS: Final = (
    (0x11, 0x00),
    (0x11, 0x06),
    (0x13, 0x03),
    (0x13, 0x10),
    (0x16, 0x07),
    (0x18, 0x0F),
    (0x1A, 0x1C),
)
_CODES: Final = (*(0x00,) * 17, 0x05, 0x02, 0x07)
_DRIVEN: Final = {"answer": 17, "plain answer": 5, "stream": 72, "event": 6}
ANSWERS_ONLY: Final = {"answer": 1}
"""The kinds of packets of a robot that streams nothing: the shortest frames."""
_FLOATS: Final = ((180.0, 3), (1.0, 3), (90.0, 3), (40.0, 2), (25.0, 2))
"""Standard deviation and count: attitude, acceleration, gyroscope, position, speed; a stream has some."""


class Corpus(NamedTuple):
    """Packets and their stream.

    Attributes:
        generation: the protocol.
        packets: what a host's decoder must find, in order.
        stream: their frames, back to back.
    """

    generation: Generation
    packets: list[Packet]
    stream: bytes

    @property
    def summary(self) -> str:
        """A line that describes it."""
        return (
            f"{self.generation.upper()}, simulated: {len(self.packets)} frames, {len(self.stream)} bytes, "
            f"{len(self.stream) / len(self.packets):.1f} bytes per frame"
        )

    def part(self, count: int) -> "Corpus":
        """Return a corpus of the first packets."""
        return _corpus(self.generation, self.packets[:count])


def second_generation(count: int, seed: int = SEED, *, kinds: Mapping[str, int] = _DRIVEN) -> Corpus:
    """Return V2 traffic as a host receives it.

    Args:
        count: number of frames.
        seed: of the random numbers.
        kinds: kind -> relative frequency; by default those of a robot that streams its sensors and is driven.
    """
    random = Random(seed)
    drawn = random.choices(list(kinds), list(kinds.values()), k=count)
    return _corpus(Generation.V2, [_v2_packet(random, number, kind) for number, kind in enumerate(drawn)])


def first_generation(count: int, seed: int = SEED) -> Corpus:
    """Return V1 traffic as a host receives it: responses, data streaming, collisions."""
    random = Random(seed)
    return _corpus(Generation.V1, [_v1_packet(random, number) for number in range(count)])


def commands(count: int, seed: int = SEED) -> list[Command]:
    """Return commands to a node, with payloads of 0 to 11 bytes."""
    random = Random(seed)
    lengths = (0, 0, 0, 1, 2, 3, 4, 4, 7, 11)
    return [
        Command(
            *random.choice(_PAIRS), random.randbytes(random.choice(lengths)), random.choice((_RADIO, _MAIN))
        )
        for _ in range(count)
    ]


def damaged(corpus: Corpus, share: float, seed: int = SEED) -> Corpus:
    """Return a corpus in which a fraction of the frames is damaged; its packets are the undamaged ones.

    A damaged frame lost its start, its end or some bytes, has a flipped bit, or has noise before it.
    """
    random = Random(seed)
    codec = CODECS[corpus.generation]
    kept: list[Packet] = []
    stream = bytearray()
    for packet in corpus.packets:
        frame = codec.frame_of(packet)
        if random.random() >= share:
            kept.append(packet)
            stream += frame
        else:
            stream += _damage(frame, random)
    return Corpus(corpus.generation, kept, bytes(stream))


def chunks(stream: bytes, size: int) -> list[bytes]:
    """Split a stream as reads of one size, or BLE notifications, deliver it."""
    return [stream[at : at + size] for at in range(0, len(stream), size)]


def _corpus(generation: Generation, packets: list[Packet]) -> Corpus:
    codec = CODECS[generation]
    return Corpus(generation, packets, b"".join(codec.frame_of(packet) for packet in packets))


def _v2_packet(random: Random, number: int, kind: str) -> Packet:
    match kind:
        case "answer":
            did, cid = random.choice(_PAIRS)
            payload = random.randbytes(random.choice(_ANSWERS))
            source = random.choice((_RADIO, _MAIN))
            return Response(number % 255, random.choice(_CODES), payload, did, cid, source, _HOST, 0x39)
        case "plain answer":
            did, cid = random.choice(_PAIRS)
            return Response(number % 255, 0, random.randbytes(random.choice(_ANSWERS)), did, cid, flags=0x09)
        case "stream" if random.random() < 0.5:
            return Notification(0x18, 0x02, _readings(random), _MAIN, None, 0xFF, 0x28)
        case "stream":
            return Notification(0x18, 0x02, _readings(random), _MAIN, _HOST, 0xFF, 0x38)
        case _:
            did, cid, size = random.choice(
                ((0x13, 0x06, 0), (0x13, 0x21, 1), (0x17, 0x0B, 16), (0x16, 0x12, 2))
            )
            return Notification(did, cid, random.randbytes(size), None, None, 0xFF, 0x08)


def _v1_packet(random: Random, number: int) -> Packet:
    match random.choices(("answer", "stream", "collision"), (22, 72, 6))[0]:
        case "answer":
            return Response(number % 256, 0, random.randbytes(random.choice(_ANSWERS)), flags=0xFF)
        case "stream":
            values = [round(random.gauss(0, 400)) for _ in range(random.choice((6, 13, 13, 26)))]
            return Notification(None, 0x03, Struct(f">{len(values)}h").pack(*values), flags=0xFE)
        case _:
            return Notification(None, 0x07, random.randbytes(16), flags=0xFE)


def _readings(random: Random) -> bytes:
    """Groups of sensors in single precision, mostly the five that spherov2's sphero_edu asks for."""
    groups = random.choice((_FLOATS[:1], _FLOATS[1:3], *[_FLOATS] * 6))
    values = [random.gauss(0, spread) for spread, count in groups for _ in range(count)]
    return Struct(f">{len(values)}f").pack(*values)


def _damage(frame: bytes, random: Random) -> bytes:
    at = random.randrange(1, len(frame) - 1)
    match random.randrange(5):
        case 0:
            return frame[1:]
        case 1:
            return frame[:at]
        case 2:
            return frame[:at] + frame[at + random.randrange(1, 4) :]
        case 3:
            return frame[:at] + bytes((frame[at] ^ 1 << random.randrange(8),)) + frame[at + 1 :]
        case _:
            return random.randbytes(random.randrange(1, 20)) + frame[:at]
