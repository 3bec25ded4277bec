"""One made-up conversation of phones and robots, from which captures of every kind are written."""

from itertools import count
from typing import NamedTuple

from sphero_probe.catalogue.gatt import (
    ANTI_DOS_CHARACTERISTIC,
    API_CHARACTERISTIC,
    V1_COMMAND_CHARACTERISTIC,
    V1_RESPONSE_CHARACTERISTIC,
)
from sphero_probe.protocol.packets import Command, Notification, Response
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v2 import V2

START = 1_700_000_000_000_000
"""Microseconds since 1970 at which the conversation begins."""


class Att(NamedTuple):
    """One ATT packet: microseconds, number of its connection, from the phone or not, its bytes."""

    time: int
    connection: int
    sent: bool
    data: bytes


def uuid(text: str) -> bytes:
    return bytes.fromhex(text.replace("-", ""))[::-1]


def v2_command(seq: int, did: int, cid: int, payload: bytes = b"") -> bytes:
    return V2.encode_command(Command(did, cid, payload, 0x12), seq)


def v2_answer(seq: int, did: int, cid: int, payload: bytes = b"", code: int = 0) -> bytes:
    return V2.encode_response(Response(seq, code, payload, did, cid, 0x12, 0x01, 0x39))


BATTERY = V2.encode_notification(Notification(0x13, 0x21, b"\x01", 0x12, None, 0xFF, 0x28))
LONG = V2.encode_notification(Notification(0x18, 0x02, bytes(range(60)), 0x12, None, 0xFF, 0x28))


def _le(number: int) -> bytes:
    return number.to_bytes(2, "little")


def discovery(*rows: tuple[int, str]) -> list[tuple[bool, bytes]]:
    """Ask for characteristics and tell their value handles and UUIDs, one an answer."""
    said: list[tuple[bool, bytes]] = []
    for handle, text in rows:
        said.append((True, b"\x08" + _le(handle - 1) + b"\xff\xff" + _le(0x2803)))
        row = _le(handle - 1) + b"\x1e" + _le(handle) + uuid(text)
        said.append((False, bytes((0x09, len(row))) + row))
    return said


def write(handle: int, data: bytes) -> tuple[bool, bytes]:
    return (True, b"\x52" + _le(handle) + data)


def request(handle: int, data: bytes) -> list[tuple[bool, bytes]]:
    return [(True, b"\x12" + _le(handle) + data), (False, b"\x13")]


def notify(handle: int, data: bytes) -> tuple[bool, bytes]:
    return (False, b"\x1b" + _le(handle) + data)


def indicate(handle: int, data: bytes) -> list[tuple[bool, bytes]]:
    return [(False, b"\x1d" + _le(handle) + data), (True, b"\x1e")]


def prepared(handle: int, data: bytes) -> list[tuple[bool, bytes]]:
    said: list[tuple[bool, bytes]] = []
    for at in range(0, len(data), 6):
        piece = _le(handle) + _le(at) + data[at : at + 6]
        said += [(True, b"\x16" + piece), (False, b"\x17" + piece)]
    return [*said, (True, b"\x18\x01"), (False, b"\x19")]


def many(handle: int, *values: bytes) -> tuple[bool, bytes]:
    return (False, b"\x23" + b"".join(_le(handle) + _le(len(data)) + data for data in values))


def found_v2() -> list[tuple[bool, bytes]]:
    """A BOLT+ whose discovery is in the capture, by every way to carry a value."""
    return [
        (True, b"\x02\x05\x02"),
        (False, b"\x03\xf7\x00"),
        *discovery((0x1C, API_CHARACTERISTIC), (0x20, ANTI_DOS_CHARACTERISTIC)),
        *request(0x20, b"usetheforce...band"),
        write(0x1C, v2_command(1, 0x13, 0x10)),
        notify(0x1C, v2_answer(1, 0x13, 0x10, b"\x03")),
        *request(0x1C, v2_command(2, 0x11, 0x00)),
        *indicate(0x1C, v2_answer(2, 0x11, 0x00, b"\x00\x06\x00\x0f\x00\x00")),
        *prepared(0x1C, v2_command(3, 0x1A, 0x1C, bytes(range(20)))),
        notify(0x1C, v2_answer(3, 0x1A, 0x1C)[:5]),
        notify(0x1C, v2_answer(3, 0x1A, 0x1C)[5:]),
        many(0x1C, BATTERY, LONG[:11]),
        notify(0x1C, LONG[11:]),
        write(0x1C, v2_command(4, 0x77, 0x01)),
        notify(0x1C, v2_answer(4, 0x77, 0x01, code=0x02)),
    ]


def cached_v1() -> list[tuple[bool, bytes]]:
    """A V1 robot whose handles the phone knew before."""
    return [
        write(0x0E, V1.encode_command(Command(0x00, 0x20), 7)),
        notify(0x11, V1.encode_response(Response(7, 0, bytes(8)))),
        write(0x0E, V1.encode_command(Command(0x02, 0x20, b"\x01\x02\x03\x00"), 8)),
        notify(0x11, V1.encode_response(Response(8, 0))),
        notify(0x11, V1.encode_notification(Notification(None, 0x07, b"\x01"))),
    ]


def found_v1() -> list[tuple[bool, bytes]]:
    rows = discovery((0x0E, V1_COMMAND_CHARACTERISTIC), (0x11, V1_RESPONSE_CHARACTERISTIC))
    return [*rows, *cached_v1()]


def foreign() -> list[tuple[bool, bytes]]:
    """A thermometer: a frame on a characteristic of its own, and values that begin as frames."""
    return [
        *discovery((0x30, "0000fff1-0000-1000-8000-00805f9b34fb")),
        notify(0x30, BATTERY),
        *[notify(0x31, bytes((0x8D, number, 0x20, number * 7 % 256))) for number in range(30)],
        *[write(0x32, bytes((0xFF, 0xFF, number))) for number in range(30)],
    ]


def woven(*talks: list[tuple[bool, bytes]], step: int = 7_500) -> list[Att]:
    """Mix connections, a packet of each in turn."""
    times = count(START, step)
    longest = max(map(len, talks))
    return [
        Att(next(times), number, *talk[at])
        for at in range(longest)
        for number, talk in enumerate(talks)
        if at < len(talk)
    ]


V2_FRAMES = [
    v2_command(1, 0x13, 0x10),
    v2_answer(1, 0x13, 0x10, b"\x03"),
    v2_command(2, 0x11, 0x00),
    v2_answer(2, 0x11, 0x00, b"\x00\x06\x00\x0f\x00\x00"),
    v2_command(3, 0x1A, 0x1C, bytes(range(20))),
    v2_answer(3, 0x1A, 0x1C),
    BATTERY,
    LONG,
    v2_command(4, 0x77, 0x01),
    v2_answer(4, 0x77, 0x01, code=0x02),
]
V1_FRAMES = [data[3:] for _, data in cached_v1()]
