"""Decodes bytes into packets with names and fields; no robot is needed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from sphero_probe.api.named_fields import NamedFields
from sphero_probe.catalogue.meaning import packet_meaning
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.autodetect import AutoDecoder, Detected
from sphero_probe.protocol.packets import (
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Role,
)


@dataclass(frozen=True, slots=True)
class DecodedPacket(NamedFields):
    """A packet, its name and its fields.

    The decoded fields can be read by name: ``packet.percentage``, or ``packet["percentage"]``.

    Attributes:
        generation: its protocol.
        kind: ``command``, ``response``, ``notification`` or ``malformed``.
        packet: its ids, codes and payload: a ``Request``, ``Response``, ``Notification`` or ``Malformed``.
        name: the name of its command or notification, None where the catalogue has none.
        fields: the decoded payload; empty where no layout is known.
        units: field name -> its unit, for the fields that have one.
        raw: the bytes of the whole frame.
        note: what is wrong with a malformed packet, or what does not match the layout; otherwise empty.
    """

    generation: Generation
    kind: str
    packet: Packet
    name: str | None
    fields: Mapping[str, object]
    units: Mapping[str, str]
    raw: bytes
    note: str

    @classmethod
    def of(
        cls,
        packet: Packet,
        generation: Generation,
        robot: Robot | None = None,
        streams: StreamDecoder | None = None,
    ) -> Self:
        """Return a packet with what the catalogue says about it.

        Args:
            packet: the packet.
            generation: its protocol.
            robot: the model, None where it is not known.
            streams: the decoder of the robot's sensor streams, None where its commands were not followed.
        """
        row, decoded = packet_meaning(packet, generation, robot, streams)
        problem = decoded.problem if decoded else ""
        return cls(
            generation=generation,
            kind=_kind(packet),
            packet=packet,
            name=row.name if row else None,
            fields=decoded.fields if decoded else {},
            units=decoded.units if decoded else {},
            raw=CODECS[generation].frame_of(packet),
            note=packet.reason if isinstance(packet, Malformed) else problem,
        )

    @property
    def payload(self) -> bytes:
        """The argument or data bytes; empty for a malformed packet."""
        match self.packet:
            case Malformed():
                return b""
            case Request(command=command):
                return command.payload
            case packet:
                return packet.payload


def decode(data: bytes, generation: Generation | str | None = None) -> list[DecodedPacket]:
    """Return the packets in some bytes, in order; bytes that are not a packet become ``malformed``.

    Args:
        data: one or more frames, of either direction, in one piece.
        generation: ``"v1"`` or ``"v2"``; None detects it, also where both are mixed.

    Raises:
        ValueError: there is no generation of that name.
    """
    if generation is None:
        detector = AutoDecoder()
        detected = [*detector.feed(data), *detector.end()]
    else:
        fixed = Generation(generation)
        decoder = CODECS[fixed].decoder(Role.OBSERVER)
        detected = [Detected(fixed, packet) for packet in (*decoder.feed(data), *decoder.give_up())]
    return [DecodedPacket.of(packet, spoken) for spoken, packet in detected]


def _kind(packet: Packet) -> str:
    match packet:
        case Request():
            return "command"
        case Notification():
            return "notification"
        case Malformed():
            return "malformed"
        case _:
            return "response"
