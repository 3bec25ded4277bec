"""What every kind of capture is turned into before L2CAP: pieces of connections, and what is said of them."""

from collections import Counter
from typing import NamedTuple, Protocol

from sphero_probe.captures.record import Record


class Line(NamedTuple):
    """One connection as the capture names it.

    Attributes:
        interface: number of the interface or adapter.
        handle: HCI connection handle or access address; None for a serial line.
    """

    interface: int
    handle: int | None


class Piece(NamedTuple):
    """Some bytes of a connection.

    Attributes:
        time: nanoseconds since 1970, None where it is not known.
        line: the connection.
        sent: by the capturing host, or by the central of a captured radio link; None where it is not known.
        start: an L2CAP packet begins here; False for its continuation.
        data: the bytes.
    """

    time: int | None
    line: Line
    sent: bool | None
    start: bool
    data: bytes


class Opened(NamedTuple):
    """A connection was made; ``peer`` is the other device's Bluetooth address, None where it is not known."""

    line: Line
    peer: str | None


class Closed(NamedTuple):
    """A connection ended."""

    line: Line


class Named(NamedTuple):
    """A device said its name."""

    peer: str
    name: str


class Serial(NamedTuple):
    """Some bytes of a serial line; ``sent`` as in ``Piece``."""

    time: int | None
    line: Line
    sent: bool | None
    data: bytes


class AttPacket(NamedTuple):
    """One whole packet of the attribute protocol, whatever device it belongs to; ``sent`` as in ``Piece``."""

    time: int | None
    line: Line
    sent: bool | None
    data: bytes


Event = Piece | Opened | Closed | Named | Serial


class LinkReader(Protocol):
    """Reads the records of one link type on one interface."""

    def read(self, record: Record) -> list[Event]:
        """Return what a record says; a damaged one says nothing and is counted."""
        ...


class Counts(Counter[str]):
    """What was passed over, in words, and how often."""


def address_text(octets: bytes) -> str:
    """Return a Bluetooth address as people write it; it is sent with its last byte first."""
    return octets[::-1].hex(":").upper()


def advertised_name(data: bytes) -> str | None:
    """Return the name in advertising data, None where it has none."""
    while len(data) > 1 and data[0]:
        if data[1] in {0x08, 0x09}:
            return data[2 : 1 + data[0]].decode("utf-8", "replace") or None
        data = data[1 + data[0] :]
    return None
