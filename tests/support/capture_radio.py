"""Writes a conversation as it is on the air: link types 251, 256 and 272."""

import struct
from collections.abc import Iterable

from tests.support.capture_conversation import Att
from tests.support.capture_writers import PEERS, Raw, address, l2cap

ADVERTISING = 0x8E89BED6
SEED = 0x5A17C3


def crc(data: bytes, seed: int) -> bytes:
    """The checksum bit by bit, as the specification draws it: taps 24, 10, 9, 6, 4, 3, 1, 0."""
    register = [seed >> bit & 1 for bit in range(24)]
    for byte in data:
        for bit in range(8):
            feedback = register[23] ^ (byte >> bit & 1)
            register = [feedback, *register[:23]]
            for tap in (1, 3, 4, 6, 9, 10):
                register[tap] ^= feedback
    bits = register[::-1]
    return bytes(sum(bits[8 * at + bit] << bit for bit in range(8)) for at in range(3))


def on_air(access: int, head: int, payload: bytes, seed: int) -> bytes:
    body = bytes((head, len(payload))) + payload
    return struct.pack("<I", access) + body + crc(body, seed)


class Air:
    """Keeps each connection's sequence numbers and wraps each packet for a link type."""

    def __init__(self, link: int) -> None:
        self.link = link
        self.packets: list[Raw] = []
        self._numbers: dict[tuple[int, bool], int] = {}

    def advertise(self, time: int, connection: int) -> None:
        """Advertise a name, and connect."""
        peer = address(PEERS[connection])
        name = f"BP-000{connection}".encode()
        data = bytes((len(name) + 1, 9)) + name
        self._add(time, ADVERTISING, 0x40, peer + data, 0x555555, None)
        link = struct.pack("<I", self.access(connection)) + SEED.to_bytes(3, "little") + b"\x02" + bytes(2)
        link += struct.pack("<HHH", 6, 0, 100) + b"\xff\xff\xff\xff\x1f" + b"\x05"
        self._add(time + 1000, ADVERTISING, 0xC5, b"\x01\x02\x03\x04\x05\xc6" + peer + link, 0x555555, None)

    @staticmethod
    def access(connection: int) -> int:
        return 0x50123450 + connection

    def send(
        self, time: int, connection: int, kind: int, payload: bytes, *, sent: bool, new: bool = True
    ) -> None:
        """Send one packet; ``new`` as opposed to the last one sent again."""
        number = self._numbers.get((connection, sent), 1) ^ new
        self._numbers[connection, sent] = number
        self._add(time, self.access(connection), kind | number << 3, payload, SEED, sent)

    def damage(self, back: int) -> None:
        """Send a copy of the last packet that many microseconds before it, with a wrong checksum."""
        good = self.packets.pop()
        flagged = bytearray(good.data)
        flagged[-1] ^= 0xFF
        if self.link == 256:
            flagged[9] &= ~0x08
        elif self.link == 272:
            flagged[8] &= ~0x01
        self.packets += [good._replace(data=bytes(flagged), time=good.time - back), good]

    def _add(self, time: int, access: int, head: int, payload: bytes, seed: int, sent: bool | None) -> None:
        data = on_air(access, head, payload, seed)
        if self.link == 256:
            kind = 0 if sent is None else 2 if sent else 3
            flags = 0x0001 | 0x0010 | kind << 7 | 0x0400 | 0x0800
            data = struct.pack("<BbbBIH", 3, -50, -90, 0, access, flags) + data
        elif self.link == 272:
            radio = struct.pack("<BBBBHI", 10, 1 | bool(sent) << 1, 3, 50, 1, time & 0xFFFFFFFF)
            data = (
                b"\x07"
                + struct.pack("<HBHB", len(radio + data), 3, len(self.packets), 2 if sent is None else 6)
                + radio
                + data
            )
        self.packets.append(Raw(time, self.link, data))


def radio(
    talk: Iterable[Att], link: int, size: int = 27, *, damaged: bool = True, repeated: bool = True
) -> list[Raw]:
    """Talk in connection events: central first, the peripheral 150 µs behind it, empty packets in between.

    Some packets come damaged first, some are sent again, where that is wanted.
    """
    air = Air(link)
    packets = list(talk)
    for connection in sorted({packet.connection for packet in packets}):
        air.advertise(packets[0].time - 50_000 + connection * 5_000, connection)
    for number, (time, connection, sent, data) in enumerate(packets):
        whole = l2cap(data)
        pieces = [whole[at : at + size] for at in range(0, len(whole), size)]
        for at, piece in enumerate(pieces):
            now, kind = time + at * 2_000, 1 if at else 2
            if not sent:
                air.send(now, connection, 1, b"", sent=True)
                now += 80 + 150
            air.send(now, connection, kind, piece, sent=sent)
            if damaged and number % 5 == 0 and sent:
                air.damage(1_000)
            if repeated and number % 3 == 0 and sent:
                air.send(now + 1_000, connection, kind, piece, sent=sent, new=False)
    return air.packets
