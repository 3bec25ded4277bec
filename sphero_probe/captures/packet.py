"""What a capture is read for: packets with their time, their direction and their connection."""

from typing import NamedTuple

from sphero_probe.protocol.packets import Generation, Packet


class Connection(NamedTuple):
    """One connection of a capture.

    Attributes:
        number: in order of appearance, from 1.
        peer: the other device's Bluetooth address, None where the capture does not tell.
        name: the device's name, None where the capture does not tell.
    """

    number: int
    peer: str | None = None
    name: str | None = None

    @property
    def label(self) -> str:
        """Number and name in a word: ``1``, ``1 BP-1234``."""
        said = self.name or self.peer
        return f"{self.number} {said}" if said else str(self.number)


class CapturedPacket(NamedTuple):
    """One Sphero packet of a capture.

    Attributes:
        time: nanoseconds since 1970 at which its last byte came, None where the capture does not say.
        connection: which it was heard on.
        to_robot: True for what a host sent, False for what a robot sent, None where it is not known.
        handle: of the characteristic; None on a serial line.
        parts: sizes in bytes of the values or records that carried it; the first and the last may carry parts
            of its neighbours.
        generation: the protocol.
        packet: what it says.
        raw: its frame.
        doubt: why damage may have made it of other bytes though it is valid, or empty.
    """

    time: int | None
    connection: Connection
    to_robot: bool | None
    handle: int | None
    parts: tuple[int, ...]
    generation: Generation
    packet: Packet
    raw: bytes
    doubt: str = ""
