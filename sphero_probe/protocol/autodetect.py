"""A stream of either generation, or of both, in; packets with their generation out.

V2 frames are looked for first: they have an end mark and escapes, so noise seldom looks like one. What is no
V2 frame is offered to V1; only what neither can read is malformed.
"""

from typing import Final, NamedTuple

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Malformed, Packet, Role

_MAX_HELD: Final = 1 << 16
"""Bytes of rubbish that are kept together before they are given up."""


class Detected(NamedTuple):
    """A packet and the generation it was read by."""

    generation: Generation
    packet: Packet


class AutoDecoder:
    """Decodes a stream of unknown generation, as a witness of both ends."""

    def __init__(self) -> None:
        self._second = CODECS[Generation.V2].decoder(Role.WITNESS)
        self._noise: list[Malformed] = []
        self._held = 0

    def feed(self, data: bytes) -> list[Detected]:
        """Take the next bytes of the stream and return what they complete."""
        found: list[Detected] = []
        for packet in self._second.feed(data):
            if isinstance(packet, Malformed):
                self._noise.append(packet)
                self._held += len(packet.raw)
                if self._held > _MAX_HELD:
                    found += self._sift()
            else:
                if self._noise:
                    found += self._sift()
                found.append(Detected(Generation.V2, packet))
        return found

    def end(self) -> list[Detected]:
        """Return what is left when the stream is over."""
        held = self._second.give_up()
        self._noise += [packet for packet in held if isinstance(packet, Malformed)]
        return self._sift()

    def _sift(self) -> list[Detected]:
        """Offer a stretch that is no V2 to V1; keep V2's reasons where V1 finds nothing in it."""
        noise, self._noise, self._held = self._noise, [], 0
        first = CODECS[Generation.V1].decoder(Role.WITNESS)
        packets = first.feed(b"".join(packet.raw for packet in noise)) + first.give_up()
        if all(isinstance(packet, Malformed) for packet in packets):
            return [Detected(Generation.V2, packet) for packet in noise]
        return [Detected(Generation.V1, packet) for packet in packets]
