"""Reads the response to one command from any kind of connection."""

from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Response, Role
from sphero_probe.transports.base import Connection


async def hear(connection: Connection, seq: int) -> Response:
    """Read until there is a response with this sequence number; skip others."""
    decoder = CODECS[connection.generation].decoder(Role.HOST)
    while True:
        for packet in decoder.feed(await connection.transport.read()):
            if isinstance(packet, Response) and packet.seq == seq:
                return packet
