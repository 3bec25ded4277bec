"""A robot's conversation as the records of a capture, with the connection and the discovery that explain it.

Wireshark shows ATT with the robot's characteristics, and no plugin is needed. What is made up is the HCI and
ATT around the frames; the frames are those that were sent and received, in their order and at their times.
"""

from collections.abc import Iterator
from struct import pack
from typing import Final

from sphero_probe.captures.record import HCI_H4_DIRECTION, RTAC_SERIAL, Record
from sphero_probe.catalogue.gatt import PROFILES, GattProfile
from sphero_probe.protocol.packets import Generation

_HANDLE: Final = 0x0040
_HANDLES: Final = 0x0E00
_MTU: Final = 247
_ACL, _EVENT = 2, 4
_LE_META: Final = 0x3E
_ATT_CHANNEL: Final = 4
_SERVICE, _FIRST, _CONFIGURE, _SECOND = 0x0010, 0x0012, 0x0013, 0x0015
_WRITE_COMMAND, _NOTIFICATION = 0x52, 0x1B
_NAME_ROOM: Final = 27
_TX_START, _RX_START = 0x01, 0x02


class BleScript:
    """One robot over Bluetooth LE, as an HCI log of the host would have it; link type 201."""

    link = HCI_H4_DIRECTION

    def __init__(self, generation: Generation, address: str, name: str, number: int = 0) -> None:
        """Take what the robot is called.

        Args:
            generation: the protocol it speaks.
            address: its Bluetooth address, ``AA:BB:CC:DD:EE:FF``.
            name: as it advertises.
            number: of the connection, for its handle.
        """
        self._profile: GattProfile = next(each for each in PROFILES if each.generation is generation)
        self._address = bytes.fromhex(address.replace(":", ""))[::-1]
        self._handle = _HANDLE + number % _HANDLES
        self._name = name.encode()[:_NAME_ROOM]
        one = self._profile.commands == self._profile.answers
        self._commands, self._answers = _FIRST, _FIRST if one else _SECOND

    def opening(self, time: int) -> Iterator[Record]:
        """Yield the advertisement, the connection and the discovery."""
        data = bytes((len(self._name) + 1, 0x09)) + self._name
        report = b"\x02\x01\x00\x01" + self._address + bytes((len(data),)) + data + b"\xc8"
        yield self._record(time, _EVENT, bytes((_LE_META, len(report))) + report, sent=False)
        body = (
            b"\x01\x00"
            + pack("<H", self._handle)
            + b"\x00\x01"
            + self._address
            + pack("<HHHB", 12, 0, 500, 0)
        )
        yield self._record(time, _EVENT, bytes((_LE_META, len(body))) + body, sent=False)
        yield self._att(time, pack("<BH", 0x02, _MTU), sent=True)
        yield self._att(time, pack("<BH", 0x03, _MTU), sent=False)
        yield self._att(time, pack("<BHHH", 0x10, 1, 0xFFFF, 0x2800), sent=True)
        service = pack("<HH", _SERVICE, _SECOND + 1) + _octets(self._profile.service)
        yield self._att(time, bytes((0x11, len(service))) + service, sent=False)
        yield self._att(time, pack("<BHHH", 0x08, _SERVICE, _SECOND + 1, 0x2803), sent=True)
        found = {self._commands: self._profile.commands, self._answers: self._profile.answers}
        rows = b"".join(
            pack("<HBH", handle - 1, 0x1C, handle) + _octets(uuid) for handle, uuid in found.items()
        )
        yield self._att(time, bytes((0x09, len(rows) // len(found))) + rows, sent=False)
        yield self._att(time, pack("<BHH", 0x12, self._answers + 1, 1), sent=True)
        yield self._att(time, b"\x13", sent=False)

    def sent(self, time: int, data: bytes) -> Iterator[Record]:
        """Yield the writes of a command."""
        yield from self._values(time, _WRITE_COMMAND, self._commands, data, sent=True)

    def received(self, time: int, data: bytes) -> Iterator[Record]:
        """Yield the notifications of what the robot sent."""
        yield from self._values(time, _NOTIFICATION, self._answers, data, sent=False)

    def _values(self, time: int, opcode: int, handle: int, data: bytes, *, sent: bool) -> Iterator[Record]:
        most = _MTU - 3
        for at in range(0, len(data), most):
            yield self._att(time, pack("<BH", opcode, handle) + data[at : at + most], sent=sent)

    def _att(self, time: int, packet: bytes, *, sent: bool) -> Record:
        whole = pack("<HH", len(packet), _ATT_CHANNEL) + packet
        start = self._handle if sent else self._handle | 0x2000
        return self._record(time, _ACL, pack("<HH", start, len(whole)) + whole, sent=sent)

    def _record(self, time: int, kind: int, data: bytes, *, sent: bool) -> Record:
        return Record(time, self.link, pack(">IB", not sent, kind) + data, 0, sent)


class SerialScript:
    """One robot on a serial line; link type 250."""

    link = RTAC_SERIAL

    def __init__(self, interface: int = 0) -> None:
        """Take the number of the interface that has the link type."""
        self._interface = interface

    def opening(self, time: int) -> Iterator[Record]:
        """Yield nothing: a line just is."""
        del time
        yield from ()

    def sent(self, time: int, data: bytes) -> Iterator[Record]:
        """Yield the record of bytes that were sent."""
        yield self._record(time, _TX_START, data, sent=True)

    def received(self, time: int, data: bytes) -> Iterator[Record]:
        """Yield the record of bytes that were received."""
        yield self._record(time, _RX_START, data, sent=False)

    def _record(self, time: int, kind: int, data: bytes, *, sent: bool) -> Record:
        seconds, nanoseconds = divmod(time, 1_000_000_000)
        header = pack(">IIBBH", seconds & 0xFFFFFFFF, nanoseconds // 1000, kind, 0, 0)
        return Record(time, self.link, header + data, self._interface, sent)


Script = BleScript | SerialScript


def _octets(uuid: str) -> bytes:
    return bytes.fromhex(uuid.replace("-", ""))[::-1]
