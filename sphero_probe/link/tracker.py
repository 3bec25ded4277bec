"""Which answer belongs to which command: commands, bytes and the time in, frames and exchanges out. Pure."""

from collections import deque
from collections.abc import Collection, Iterable, Iterator
from typing import Final, NamedTuple

from sphero_probe.link.exchange import Answered, Exchange, LateResponse, Silent, Unsolicited
from sphero_probe.protocol.address import Address
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
"""Seconds before the handle of a silent command is used again: its answer may still come."""
QUIET: Final = 0.25
"""Seconds without a byte after which a half frame is given up when a deadline passes."""

ECHO: Final = 0.05
"""Seconds before the handle of an answered command is used again: a repeated answer comes right behind."""

_REMEMBERED: Final = 4096
"""Settled handles that are kept at least as long as they rest, and at most ``REST``."""
_FROM_ANY_NODE = (Verdict.NO_TARGET, Verdict.TARGET_UNAVAILABLE)

TOLERANCES: Final = ("source", "seq", "flags")
"""In what an answer may differ and still count, where that was asked for: the node that it names, its
sequence number, or the flag that makes it a response."""

_Handle = tuple[int, int | None, int | None]
"""What an answer is recognised by: its sequence number, and DID and CID where answers name them."""


class _Asked(NamedTuple):
    command: Command
    sent: bytes
    at: float
    deadline: float


class _Settled(NamedTuple):
    exchange: Answered | Silent
    at: float
    rests_until: float


class Tracker:
    """The book-keeping of one link; ``now`` is any clock in seconds that does not run backwards.

    A handle rests before it is used again, so that an answer that comes late, or twice, is never taken for
    another's. Where answers name DID and CID, those belong to the handle: a number may go out with another
    command while it rests.
    """

    def __init__(self, codec: Codec, tolerate: Collection[str] = ()) -> None:
        """Take the codec, and which of ``TOLERANCES`` apply to this robot."""
        self._codec = codec
        self._tolerate = frozenset(tolerate)
        self._decoder = codec.decoder(Role.HOST)
        self._waiting: dict[int, _Asked] = {}
        self._settled: dict[_Handle, _Settled] = {}
        self._in_order: deque[tuple[_Handle, float]] = deque()
        self._next = 0
        self._heard_at = float("-inf")

    def free_at(self, command: Command, now: float) -> float:
        """Return when a number will be free for a command: ``now``, later, or infinity while all wait."""
        earliest = float("inf")
        for seq in self._codec.sequence_numbers:
            if seq not in self._waiting:
                earliest = min(earliest, max(now, self._rests_until(seq, command)))
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
            if seq not in self._waiting and self._rests_until(seq, command) <= now:
                break
        else:
            raise RuntimeError("every sequence number is waiting or resting")
        frame = self._codec.encode_command(command, seq)
        self._next = (numbers.index(seq) + 1) % len(numbers)
        self._forget(now)
        self._settled.pop(self._handle(seq, command.did, command.cid), None)
        self._waiting[seq] = _Asked(command, frame, now, now + timeout)
        return seq, frame

    def shorten_deadlines(self, numbers: Iterable[int], *, deadline: float) -> None:
        """Let commands count as silent at this time, if they still wait then and would wait longer."""
        for seq in numbers:
            asked = self._waiting.get(seq)
            if asked and asked.deadline > deadline:
                self._waiting[seq] = asked._replace(deadline=deadline)

    def hear(self, data: bytes, *, now: float) -> Iterator[Exchange | Unsolicited]:
        """Take bytes from the robot and yield what they settle and what was said besides."""
        self._heard_at = now
        yield from self._make_of(self._decoder.feed(data), now)

    def expire(self, *, now: float) -> Iterator[Exchange | Unsolicited]:
        """Yield what a half frame held back, if one blocks the line, then the commands whose time is up."""
        if now - self._heard_at >= QUIET and self._late(now):
            yield from self._make_of(self._decoder.give_up(), now)
        for seq in self._late(now):
            asked = self._waiting.pop(seq)
            silent = Silent(asked.command, seq, asked.sent, now - asked.at)
            self._settle(silent, now, now + REST)
            yield silent

    def next_deadline(self) -> float | None:
        """Return when ``expire`` will next have something to say, None while nothing waits."""
        return min((asked.deadline for asked in self._waiting.values()), default=None)

    def _late(self, now: float) -> list[int]:
        return [seq for seq, asked in self._waiting.items() if asked.deadline <= now]

    def _make_of(self, packets: list[Packet], now: float) -> Iterator[Exchange | Unsolicited]:
        for packet in packets:
            if isinstance(packet, Response):
                yield self._match(packet, now)
            elif isinstance(packet, Notification) and (response := self._tolerated(packet)):
                yield self._match(response, now)
            elif isinstance(packet, Notification | Malformed):
                yield packet
            elif isinstance(packet, Request):  # a host's decoder makes none; kept total all the same
                yield Malformed(b"", "a command came from the robot's side")

    def _match(self, response: Response, now: float) -> Answered | LateResponse:
        received = self._codec.frame_of(response)
        if "seq" in self._tolerate:
            response = response._replace(seq=self._nearest_seq(response))
        asked = self._waiting.get(response.seq)
        if asked and self._fits(response, asked.command):
            del self._waiting[response.seq]
            answered = Answered(asked.command, response.seq, asked.sent, response, received, now - asked.at)
            self._settle(answered, now, now + ECHO)
            return answered
        settled = self._settled.get((response.seq, response.did, response.cid))
        if settled and self._fits(response, settled.exchange.command):
            exchange = settled.exchange
            waited = exchange.rtt if isinstance(exchange, Answered) else exchange.waited
            return LateResponse(response, received, exchange, now - settled.at + waited)
        return LateResponse(response, received, None)

    def _tolerated(self, packet: Notification) -> Response | None:
        """Return the response that a notification stands for where flags are tolerated, else None."""
        seq = packet.seq
        asked = self._waiting.get(seq) if seq is not None and "flags" in self._tolerate else None
        if (
            asked is None
            or seq is None
            or (packet.did, packet.cid) != asked.command[:2]
            or not packet.payload
        ):
            return None
        code, payload = packet.payload[0], packet.payload[1:]
        return Response(
            seq, code, payload, packet.did, packet.cid, packet.source, packet.target, packet.flags
        )

    def _nearest_seq(self, response: Response) -> int:
        """Return the number of the longest waiting command that an answer fits but for its number."""
        if response.seq in self._waiting and self._fits(response, self._waiting[response.seq].command):
            return response.seq
        fitting = (seq for seq, asked in self._waiting.items() if self._fits(response, asked.command))
        return next(fitting, response.seq)

    def _handle(self, seq: int, did: int, cid: int) -> _Handle:
        return (seq, did, cid) if self._codec.answers_name_commands else (seq, None, None)

    def _rests_until(self, seq: int, command: Command) -> float:
        settled = self._settled.get(self._handle(seq, command.did, command.cid))
        return settled.rests_until if settled else float("-inf")

    def _settle(self, exchange: Answered | Silent, now: float, rests_until: float) -> None:
        command = exchange.command
        handle = self._handle(exchange.seq, command.did, command.cid)
        self._settled[handle] = _Settled(exchange, now, rests_until)
        self._in_order.append((handle, now))

    def _forget(self, now: float) -> None:
        """Let go of what was settled too long ago to be answered now."""
        order = self._in_order
        while order and (order[0][1] + REST <= now or len(order) > _REMEMBERED):
            handle, at = order[0]
            settled = self._settled.get(handle)
            if settled and settled.at == at:  # not asked again since
                if settled.rests_until > now:
                    break
                del self._settled[handle]
            order.popleft()

    def _fits(self, response: Response, command: Command) -> bool:
        """Compare what both sides name: DID, CID, and the node's nibble where a source is given."""
        if (response.did, response.cid) not in ((None, None), (command.did, command.cid)):
            return False
        if "source" in self._tolerate or response.source is None or command.target is None:
            return True
        asked = Address.from_byte(command.target)
        if asked.is_wildcard:
            return True
        if self._codec.verdict(response.code) in _FROM_ANY_NODE:
            return True  # another node answers for the one that is not there
        return Address.from_byte(response.source).node == asked.node
