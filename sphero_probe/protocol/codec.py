"""The interface that both generations implement; the layers above use only this, and never a frame format."""

from typing import Protocol

from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Notification,
    Packet,
    Response,
    Role,
    Verdict,
)


class Decoder(Protocol):
    """Turns bytes into packets, however the stream is split; no input makes it raise."""

    def feed(self, data: bytes) -> list[Packet]:
        """Take the next bytes of the stream and return the packets that they complete."""
        ...

    def give_up(self) -> list[Packet]:
        """Return everything that is still buffered, because the line went quiet.

        That is an unfinished frame as ``Malformed``, and any packets inside it that a wrong length had
        hidden.
        """
        ...


class Codec(Protocol):
    """Encodes and decodes the packets of one generation."""

    @property
    def generation(self) -> Generation:
        """The protocol."""
        ...

    @property
    def sequence_numbers(self) -> range:
        """The sequence numbers that a host may allocate."""
        ...

    @property
    def answers_name_commands(self) -> bool:
        """Whether a response repeats the DID and CID of its command, besides the sequence number."""
        ...

    @property
    def has_addresses(self) -> bool:
        """Whether packets can name nodes, and commands ask for answers on error only."""
        ...

    @property
    def unchecked_flags(self) -> int | None:
        """The usual flags of a command where no checksum covers them and no frame has an end mark.

        There, damage can make a valid frame of bytes that were none. None in a generation that checks all.
        """
        ...

    @property
    def max_payload(self) -> int:
        """The longest payload in bytes that ``encode_*`` accepts."""
        ...

    def encode_command(
        self, command: Command, seq: int, *, answer: bool = True, activity: bool = True
    ) -> bytes:
        """Return the frame of a command.

        Args:
            command: the command; a ``target`` adds the addresses, in a generation that has them.
            seq: the sequence number, 0-255.
            answer: ask for a response.
            activity: reset the robot's sleep timer.

        Raises:
            ValueError: an id is out of range or the payload is longer than ``max_payload``.
        """
        ...

    def encode_response(self, response: Response) -> bytes:
        """Return the frame of a response (used by the simulator and the tests)."""
        ...

    def encode_notification(self, notification: Notification) -> bytes:
        """Return the frame of a notification (used by the simulator and the tests)."""
        ...

    def frame_of(self, packet: Packet) -> bytes:
        """Return the exact bytes that a packet was decoded from."""
        ...

    def may_answer(self, raw: bytes, command: Command, seq: int) -> bool:
        """Whether damaged bytes may be the remains of the response to a command.

        Args:
            raw: bytes that are not a valid packet.
            command: the command that was sent.
            seq: its sequence number.
        """
        ...

    def decoder(self, role: Role) -> Decoder:
        """Return a new decoder for one role."""
        ...

    def flag_names(self, packet: Packet) -> tuple[str, ...] | None:
        """Return the names of the flags that a packet carries, None for a packet that has no flags."""
        ...

    def verdict(self, code: int) -> Verdict:
        """Return what a code means, ``Verdict.UNLISTED`` for a code that is in no document."""
        ...

    def code_name(self, code: int) -> str:
        """Return the code's documented name, or ``unlisted``."""
        ...
