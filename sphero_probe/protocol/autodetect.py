"""Decodes a stream whose generation is not known, or which mixes both.

V2 frames are searched for first: they have an end marker and escapes, so noise seldom looks like one. All
other bytes are tried as V1. Bytes that neither decoder accepts are malformed.
"""

from itertools import repeat
from typing import Final, NamedTuple

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Malformed, Packet, Role

_MAX_HELD: Final = 1 << 16
"""Bytes without a V2 frame that are collected before they are tried as V1."""


_new: Final = tuple.__new__  # a NamedTuple's own __new__ costs twice as much


class Detected(NamedTuple):
    """A packet and the generation it was read by."""

    generation: Generation
    packet: Packet


class AutoDecoder:
    """Decodes a stream of unknown generation, as an observer of both directions."""

    def __init__(self) -> None:
        self._v2 = CODECS[Generation.V2].decoder(Role.OBSERVER)
        self._noise: list[Malformed] = []
        self._held = 0

    def feed(self, data: bytes) -> list[Detected]:
        """Take the next bytes of the stream and return what they complete."""
        found: list[Detected] = []
        packets = self._v2.feed(data)
        if not self._noise and Malformed not in {*map(type, packets)}:
            return [*map(_new, repeat(Detected), zip(repeat(Generation.V2), packets))]
        for packet in packets:
            if isinstance(packet, Malformed):
                self._noise.append(packet)
                self._held += len(packet.raw)
                if self._held > _MAX_HELD:
                    found += self._try_v1()
            else:
                if self._noise:
                    found += self._try_v1()
                found.append(Detected(Generation.V2, packet))
        return found

    def end(self) -> list[Detected]:
        """Return the remaining packets at the end of the stream."""
        held = self._v2.give_up()
        self._noise += [packet for packet in held if isinstance(packet, Malformed)]
        return self._try_v1()

    def _try_v1(self) -> list[Detected]:
        """Try the bytes without a V2 frame as V1; where V1 finds nothing either, keep V2's reasons."""
        noise, self._noise, self._held = self._noise, [], 0
        v1 = CODECS[Generation.V1].decoder(Role.OBSERVER)
        packets = v1.feed(b"".join(packet.raw for packet in noise)) + v1.give_up()
        if all(isinstance(packet, Malformed) for packet in packets):
            return [Detected(Generation.V2, packet) for packet in noise]
        return [Detected(Generation.V1, packet) for packet in packets]
