"""Reads recorded packets in their order: what each means by itself, and after the packets before it.

Most packets of a recording are the notifications of a few sensor streams. What their headers mean is looked
up once, and only the numbers are read again.
"""

from collections.abc import Callable
from typing import Final, NamedTuple

from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.catalogue.meaning import payload_layout
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.packet_json import USUAL, SharedKeys, packet_keys
from sphero_probe.catalogue.streams import StreamDecoder, may_stream
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Notification, Packet

_MOST: Final = 4096
"""The most shapes that are remembered."""
_new: Final = tuple.__new__  # a NamedTuple's own __new__ costs twice as much


class ReadPacket(NamedTuple):
    """A packet and its meaning.

    Attributes:
        packet: with what earlier packets tell about it.
        raw: its frame.
        keys: as in ``PacketKeys``.
        values: as in ``PacketKeys``.
    """

    packet: Packet
    raw: bytes
    keys: SharedKeys
    values: tuple[object, ...]


class _Shape(NamedTuple):
    """Notifications with the same header and length.

    Attributes:
        keys: of all of them; ``USUAL`` vary.
        numbers: a payload -> field name -> value.
        may_stream: a command may tell what the numbers are.
    """

    keys: SharedKeys
    numbers: Callable[[bytes], dict[str, object]]
    may_stream: bool


class PacketReader:
    """Reads the packets of one recording; feed it every packet in order."""

    def __init__(self, robot: Robot | None = None, *, raw_floats: bool = False) -> None:
        """Start without any packets.

        Args:
            robot: the model, None where it is not known.
            raw_floats: as in ``Layout.decode``.
        """
        self._robot = robot
        self._raw_floats = raw_floats
        self._context = CaptureContext(robot)
        self._streams = {spoken: StreamDecoder(spoken, robot) for spoken in Generation}
        self._shapes: dict[tuple[object, ...], _Shape | None] = {}

    def read(self, generation: Generation, heard: Packet) -> ReadPacket:
        """Return the packet and its meaning; no packet makes this raise."""
        if isinstance(heard, Notification):  # most packets of a stream
            did, cid, payload, source, target, seq, flags = heard
            of_shape = (generation, did, cid, source, target, flags, len(payload))
            shape = self._shapes.get(of_shape)
            if shape and seq is not None and not (shape.may_stream and self._streams[generation].is_set_up):
                raw = CODECS[generation].encode_notification(heard)
                told = (seq, shape.numbers(payload), payload.hex(), raw.hex())
                return _new(ReadPacket, (heard, raw, shape.keys, told))
            if of_shape not in self._shapes:
                if len(self._shapes) >= _MOST:
                    self._shapes.clear()
                self._shapes[of_shape] = self._shape(generation, heard)
        packet = self._context.complete(generation, heard)
        raw = CODECS[generation].frame_of(packet)
        streams = self._streams[generation]
        streams.observe(packet)
        keys, values = packet_keys(packet, generation, raw, self._robot, streams, raw_floats=self._raw_floats)
        return _new(ReadPacket, (packet, raw, keys, values))

    def _shape(self, generation: Generation, heard: Notification) -> _Shape | None:
        """Return what all such notifications have in common; None unless they hold nothing but numbers."""
        if self._context.complete(generation, heard) is not heard:
            return None
        _, layout = payload_layout(heard, generation, self._robot)
        numbers = layout.numbers_of(len(heard.payload), raw_floats=self._raw_floats) if layout else None
        keys, _ = packet_keys(heard, generation, b"", self._robot)
        if numbers is None or keys.varying != USUAL:
            return None
        return _Shape(keys, numbers, may_stream(generation, heard))
