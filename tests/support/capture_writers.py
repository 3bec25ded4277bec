"""Writes a conversation as every kind of capture; shares nothing with the reader but the specifications."""

import struct
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from tests.support.capture_conversation import Att

COMMAND, ACL, EVENT = 1, 2, 4
PEERS = ("C0:11:22:33:44:55", "D1:22:33:44:55:66", "E2:33:44:55:66:77", "F3:44:55:66:77:88")


class Hci(NamedTuple):
    """An HCI packet: microseconds, adapter, type byte of H4, from the host or not, the packet."""

    time: int
    adapter: int
    kind: int
    sent: bool
    data: bytes


def address(text: str) -> bytes:
    return bytes.fromhex(text.replace(":", ""))[::-1]


def connected(time: int, handle: int, peer: str, adapter: int = 0) -> Hci:
    body = (
        b"\x01\x00"
        + struct.pack("<H", handle)
        + b"\x00\x01"
        + address(peer)
        + struct.pack("<HHHB", 6, 0, 500, 0)
    )
    return Hci(time, adapter, EVENT, False, bytes((0x3E, len(body))) + body)


def disconnected(time: int, handle: int, adapter: int = 0) -> Hci:
    return Hci(time, adapter, EVENT, False, b"\x05\x04\x00" + struct.pack("<H", handle) + b"\x13")


def advertised(time: int, peer: str, name: str) -> Hci:
    data = bytes((len(name) + 1, 0x09)) + name.encode()
    body = b"\x02\x01\x00\x01" + address(peer) + bytes((len(data),)) + data + b"\xc8"
    return Hci(time, 0, EVENT, False, bytes((0x3E, len(body))) + body)


def l2cap(data: bytes, channel: int = 4) -> bytes:
    return struct.pack("<HH", len(data), channel) + data


def acl(packet: Att, size: int, handle: int, adapter: int = 0) -> Iterator[Hci]:
    """Cut one ATT packet into ACL packets of at most so many bytes."""
    whole = l2cap(packet.data)
    for at in range(0, len(whole), size):
        piece = whole[at : at + size]
        boundary = 1 if at else 0 if packet.sent else 2
        head = struct.pack("<HH", handle | boundary << 12, len(piece))
        yield Hci(packet.time, adapter, ACL, packet.sent, head + piece)


def hci(talk: Iterable[Att], size: int = 27, *, opened: bool = True, first: int = 0x40) -> list[Hci]:
    """Connect, advertise and talk; each connection has its own handle."""
    packets = list(talk)
    said: list[Hci] = []
    if opened:
        for number in sorted({packet.connection for packet in packets}):
            peer = PEERS[number]
            said.append(advertised(packets[0].time - 20_000, peer, f"BP-000{number}"))
            said.append(connected(packets[0].time - 10_000, first + number, peer))
    for packet in packets:
        said += acl(packet, size, first + packet.connection)
    return said


def h4(packet: Hci) -> bytes:
    return bytes((packet.kind,)) + packet.data


def with_direction(packet: Hci) -> bytes:
    return struct.pack(">I", not packet.sent) + h4(packet)


_MONITOR = {(COMMAND, True): 2, (EVENT, False): 3, (ACL, True): 4, (ACL, False): 5}


def monitor(packet: Hci) -> bytes:
    return struct.pack(">HH", packet.adapter, _MONITOR[packet.kind, packet.sent]) + packet.data


def btsnoop(packets: Iterable[Hci], datalink: int = 1002) -> bytes:
    file = struct.pack(">8sII", b"btsnoop\0", 1, datalink)
    for packet in packets:
        flags = (not packet.sent) | (packet.kind != ACL) << 1
        data = packet.data if datalink == 1001 else h4(packet)
        if datalink == 2001:
            flags, data = packet.adapter << 16 | _MONITOR[packet.kind, packet.sent], packet.data
        stamp = packet.time + 0x00DCDDB30F2F8000
        file += struct.pack(">IIIIq", len(data), len(data), flags, 0, stamp) + data
    return file


def packetlogger(packets: Iterable[Hci], order: str = ">") -> bytes:
    kinds = {(COMMAND, True): 0, (EVENT, False): 1, (ACL, True): 2, (ACL, False): 3}
    file = b""
    for packet in packets:
        seconds, micros = divmod(packet.time, 1_000_000)
        head = struct.pack(f"{order}III", len(packet.data) + 9, seconds, micros)
        file += head + bytes((kinds[packet.kind, packet.sent],)) + packet.data
    return file


class Raw(NamedTuple):
    """A packet for pcap or pcapng: microseconds, link type, bytes, from the host or not."""

    time: int
    link: int
    data: bytes
    sent: bool | None = None


def pcap(packets: Iterable[Raw], order: str = "<", *, nanoseconds: bool = False) -> bytes:
    listed = list(packets)
    magic = 0xA1B23C4D if nanoseconds else 0xA1B2C3D4
    file = struct.pack(f"{order}IHHiIII", magic, 2, 4, 0, 0, 65535, listed[0].link)
    for packet in listed:
        seconds, micros = divmod(packet.time, 1_000_000)
        fraction = micros * 1000 if nanoseconds else micros
        file += (
            struct.pack(f"{order}IIII", seconds, fraction, len(packet.data), len(packet.data)) + packet.data
        )
    return file


def block(order: str, kind: int, body: bytes) -> bytes:
    body += b"\0" * (-len(body) % 4)
    size = struct.pack(f"{order}I", len(body) + 12)
    return struct.pack(f"{order}I", kind) + size + body + size


def option(order: str, code: int, data: bytes) -> bytes:
    return struct.pack(f"{order}HH", code, len(data)) + data + b"\0" * (-len(data) % 4)


def section(order: str) -> bytes:
    return block(order, 0x0A0D0D0A, struct.pack(f"{order}IHHq", 0x1A2B3C4D, 1, 0, -1))


def pcapng(
    packets: Iterable[Raw], order: str = "<", *, resolution: int = 6, offset: int = 0, simple: bool = False
) -> bytes:
    """One section, an interface for each link type; ``resolution`` as in if_tsresol, ``offset`` in s."""
    listed = list(packets)
    links = list(dict.fromkeys(packet.link for packet in listed))
    file = section(order) + block(order, 0x0BAD, b"custom") + block(order, 4, b"\0" * 8)
    for link in links:
        options = option(order, 9, bytes((resolution,))) + option(order, 14, struct.pack(f"{order}q", offset))
        file += block(order, 1, struct.pack(f"{order}HHI", link, 0, 65535) + options + option(order, 0, b""))
    per_second = 2 ** (resolution & 0x7F) if resolution & 0x80 else 10**resolution
    for packet in listed:
        if simple:
            file += block(order, 3, struct.pack(f"{order}I", len(packet.data)) + packet.data)
            continue
        ticks = -(-(packet.time - offset * 1_000_000) * per_second // 1_000_000)
        head = (links.index(packet.link), ticks >> 32, ticks & 0xFFFFFFFF, len(packet.data), len(packet.data))
        body = struct.pack(f"{order}IIIII", *head) + packet.data + b"\0" * (-len(packet.data) % 4)
        if packet.sent is not None:
            flags = struct.pack(f"{order}I", 2 if packet.sent else 1)
            body += option(order, 2, flags) + option(order, 0, b"")
        file += block(order, 6, body)
    return file


def as_raw(packets: Iterable[Hci], link: int) -> list[Raw]:
    wrap: dict[int, Callable[[Hci], bytes]] = {187: h4, 201: with_direction, 254: monitor}
    return [Raw(packet.time, link, wrap[link](packet), packet.sent) for packet in packets]
