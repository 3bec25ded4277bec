"""Splits streams into pieces, and decodes them."""

from collections.abc import Iterable
from itertools import pairwise

from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Malformed, Notification, Packet, Request, Response, Role

ValidPacket = Request | Response | Notification


def decoded(codec: Codec, pieces: Iterable[bytes], role: Role = Role.HOST) -> list[Packet]:
    """All packets that a new decoder returns for these pieces, including those buffered at the end."""
    decoder = codec.decoder(role)
    packets = [packet for piece in pieces for packet in decoder.feed(piece)]
    packets += decoder.give_up()
    assert decoder.give_up() == []
    return packets


def valid_packets(packets: Iterable[Packet]) -> list[ValidPacket]:
    return [packet for packet in packets if not isinstance(packet, Malformed)]


def pieces_of(stream: bytes, cuts: Iterable[int]) -> list[bytes]:
    edges = [0, *sorted(cuts), len(stream)]
    return [stream[start:end] for start, end in pairwise(edges)]


def byte_by_byte(stream: bytes) -> list[bytes]:
    return [bytes([byte]) for byte in stream]
