"""Hear the answer to one command on a connection of any kind."""

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Response, Role
from sphero_probe.transports.base import Connection


async def hear(connection: Connection, seq: int) -> Response:
    """Read until there is an answer with this sequence number; others are passed over."""
    decoder = CODECS[connection.generation].decoder(Role.HOST)
    while True:
        for packet in decoder.feed(await connection.transport.read()):
            if isinstance(packet, Response) and packet.seq == seq:
                return packet
