"""The seam between the generations: everything above speaks packets through these two protocols."""

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
    """Bytes in, packets out; any cut of the stream; never raises on input."""

    def feed(self, data: bytes) -> list[Packet]:
        """Take the next bytes of the stream and return the packets that they complete."""
        ...

    def give_up(self) -> list[Packet]:
        """Return what is held back because the line went quiet: nothing is, after this.

        That is a half frame as ``Malformed``, and the packets that a false length made it swallow.
        """
        ...


class Codec(Protocol):
    """One generation's way of writing packets as bytes."""

    @property
    def generation(self) -> Generation:
        """Which protocol this is."""
        ...

    @property
    def sequence_numbers(self) -> range:
        """The handles a host may allocate."""
        ...

    @property
    def answers_name_commands(self) -> bool:
        """Whether a response names the DID and CID that it answers; else its sequence number is all."""
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
            command: what to ask; a ``target`` adds the addresses where the generation has any.
            seq: the handle, 0-255.
            answer: ask for a response.
            activity: reset the robot's sleep timer.

        Raises:
            ValueError: an id is out of range or the payload is longer than ``max_payload``.
        """
        ...

    def encode_response(self, response: Response) -> bytes:
        """Return the frame of an answer (serves the simulator and the tests)."""
        ...

    def encode_notification(self, notification: Notification) -> bytes:
        """Return the frame of a notification (serves the simulator and the tests)."""
        ...

    def frame_of(self, packet: Packet) -> bytes:
        """Return the very bytes that a decoded packet came in."""
        ...

    def may_answer(self, raw: bytes, command: Command, seq: int) -> bool:
        """Whether damaged bytes may be what is left of the answer to a command.

        Args:
            raw: bytes that are no packet.
            command: what was asked.
            seq: its handle.
        """
        ...

    def decoder(self, role: Role) -> Decoder:
        """Return a fresh decoder for one end of the line."""
        ...

    def verdict(self, code: int) -> Verdict:
        """Return what a code means; total: an unlisted code gives ``Verdict.UNLISTED``."""
        ...

    def code_name(self, code: int) -> str:
        """Return the code's documented name, ``unlisted`` where there is none."""
        ...
