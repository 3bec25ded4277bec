"""Which answer belongs to which command: commands, bytes and the time in, frames and exchanges out. Pure."""

from collections.abc import Iterator
from typing import Final, NamedTuple

from sphero_probe.link.exchange import Answered, Aside, Exchange, Late, Silent
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import (
    Command,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Role,
    Verdict,
)

REST: Final = 10.0
"""Seconds before the sequence number of a silent command is used again: its answer may still come."""
QUIET: Final = 0.25
"""Seconds without a byte after which a half frame is given up when a deadline passes."""

ECHO: Final = 0.05
"""Seconds before the number of an answered command is used again: a repeated answer comes right behind."""

_FROM_ANY_NODE = (Verdict.NO_TARGET, Verdict.TARGET_UNAVAILABLE)
_NODE = 0x0F


class _Asked(NamedTuple):
    command: Command
    sent: bytes
    at: float
    deadline: float


class Tracker:
    """The book-keeping of one link; ``now`` is any clock in seconds that does not run backwards."""

    def __init__(self, codec: Codec) -> None:
        self._codec = codec
        self._decoder = codec.decoder(Role.HOST)
        self._waiting: dict[int, _Asked] = {}
        self._settled: dict[int, Answered | Silent] = {}
        self._rests_until: dict[int, float] = {}
        self._next = 0
        self._heard_at = float("-inf")

    def free_at(self, now: float) -> float:
        """Return when a sequence number will be free: ``now``, a later time, or infinity while all wait."""
        earliest = float("inf")
        for seq in self._codec.sequence_numbers:
            if seq in self._waiting:
                continue
            earliest = min(earliest, max(now, self._rests_until.get(seq, now)))
            if earliest <= now:
                break
        return earliest

    def ask(self, command: Command, *, now: float, timeout: float) -> tuple[int, bytes]:
        """Claim a sequence number and a deadline for a command.

        Args:
            command: what to ask.
            now: the time.
            timeout: seconds until it counts as silent.

        Returns:
            The sequence number and the frame to send.

        Raises:
            RuntimeError: no sequence number is free; see ``free_at``.
            ValueError: the command cannot be encoded.
        """
        numbers = self._codec.sequence_numbers
        for step in range(len(numbers)):
            seq = numbers[(self._next + step) % len(numbers)]
            if seq not in self._waiting and self._rests_until.get(seq, now) <= now:
                break
        else:
            raise RuntimeError("every sequence number is waiting or resting")
        frame = self._codec.encode_command(command, seq)
        self._next = (numbers.index(seq) + 1) % len(numbers)
        self._rests_until.pop(seq, None)
        self._settled.pop(seq, None)
        self._waiting[seq] = _Asked(command, frame, now, now + timeout)
        return seq, frame

    def hear(self, data: bytes, *, now: float) -> Iterator[Exchange | Aside]:
        """Take bytes from the robot and yield what they settle and what was said besides."""
        self._heard_at = now
        yield from self._make_of(self._decoder.feed(data), now)

    def expire(self, *, now: float) -> Iterator[Exchange | Aside]:
        """Yield what a half frame held back, if one blocks the line, then the commands whose time is up."""
        if now - self._heard_at >= QUIET and self._late(now):
            yield from self._make_of(self._decoder.give_up(), now)
        for seq in self._late(now):
            asked = self._waiting.pop(seq)
            silent = Silent(asked.command, seq, asked.sent, now - asked.at)
            self._settled[seq] = silent
            self._rests_until[seq] = now + REST
            yield silent

    def next_deadline(self) -> float | None:
        """Return when ``expire`` will next have something to say, None while nothing waits."""
        return min((asked.deadline for asked in self._waiting.values()), default=None)

    def _late(self, now: float) -> list[int]:
        return [seq for seq, asked in self._waiting.items() if asked.deadline <= now]

    def _make_of(self, packets: list[Packet], now: float) -> Iterator[Exchange | Aside]:
        for packet in packets:
            if isinstance(packet, Response):
                yield self._settle(packet, now)
            elif isinstance(packet, Notification | Malformed):
                yield packet
            elif isinstance(packet, Request):  # a host's decoder makes none; kept total all the same
                yield Malformed(b"", "a command came from the robot's side")

    def _settle(self, response: Response, now: float) -> Answered | Late:
        received = self._codec.encode_response(response)
        asked = self._waiting.get(response.seq)
        if asked and self._fits(response, asked.command):
            del self._waiting[response.seq]
            answered = Answered(asked.command, response.seq, asked.sent, response, received, now - asked.at)
            self._settled[response.seq] = answered
            self._rests_until[response.seq] = now + ECHO
            return answered
        earlier = self._settled.get(response.seq)
        if earlier and not self._fits(response, earlier.command):
            earlier = None
        return Late(response, received, earlier)

    def _fits(self, response: Response, command: Command) -> bool:
        """Compare what both sides name: DID, CID, and the node's nibble where a source is given."""
        if (response.did, response.cid) not in ((None, None), (command.did, command.cid)):
            return False
        if response.source is None or command.target is None or not command.target & _NODE:
            return True
        if self._codec.verdict(response.code) in _FROM_ANY_NODE:
            return True  # another node answers for the one that is not there
        return response.source & _NODE == command.target & _NODE
