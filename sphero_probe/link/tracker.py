"""Match answers to commands and keep their deadlines. It does no I/O; the caller passes bytes and times."""

from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator
from typing import Final, NamedTuple

from sphero_probe.link.exchange import Answered, Exchange, LateResponse, Silent, Unsolicited
from sphero_probe.protocol.address import WILDCARD, node_of
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

REUSE_AFTER_SILENCE: Final = 10.0
"""Seconds before the sequence number of a silent command is reused: its answer may still arrive."""
QUIET: Final = 0.25
"""Seconds without a byte after which an incomplete frame is given up once a deadline has passed."""

REUSE_AFTER_ANSWER: Final = 0.05
"""Seconds before the sequence number of an answered command is reused: a repeated answer arrives soon."""

_REMEMBERED: Final = 4096
"""Ended commands that are remembered, each until its sequence number may be reused."""
_FROM_ANY_NODE = (Verdict.NO_TARGET, Verdict.TARGET_UNAVAILABLE)

TOLERANCES: Final = ("source", "seq", "flags")
"""The fields in which an answer may differ and still count, if the caller allows it: the node that it names,
its sequence number, or the flag that makes it a response."""

_Handle = tuple[int, int | None, int | None]
"""Identifies an answer: its sequence number, and DID and CID where answers carry them."""


class _Waiting(NamedTuple):
    command: Command
    sent: bytes
    at: float
    deadline: float


class _Settled(NamedTuple):
    exchange: Answered | Silent
    at: float
    reusable_at: float


class Tracker:
    """The commands of one link that wait for an answer; ``now`` is any clock in seconds that never goes back.

    A sequence number is not reused for a while, so that a late or repeated answer is never matched to another
    command. Where answers carry DID and CID, another command may use the number meanwhile.

    Attributes:
        tolerated: how answers that were accepted differ from what they should be, in words -> how many did.
    """

    def __init__(self, codec: Codec, tolerate: Collection[str] = ()) -> None:
        """Set the codec, and which of ``TOLERANCES`` apply to this robot."""
        self._codec = codec
        self._tolerate = frozenset(tolerate)
        self.tolerated: Counter[str] = Counter()
        self._decoder = codec.decoder(Role.HOST)
        self._waiting: dict[int, _Waiting] = {}
        self._settled: dict[_Handle, _Settled] = {}
        self._answered: deque[tuple[_Handle, float]] = deque()
        self._silent: deque[tuple[_Handle, float]] = deque()
        self._next = 0
        self._heard_at = float("-inf")

    def free_at(self, command: Command, now: float) -> float:
        """Return when a sequence number is free for a command: ``now``, later, or infinity while all wait."""
        numbers = self._codec.sequence_numbers
        seq = numbers[self._next]
        if seq not in self._waiting and self._reusable_at(seq, command) <= now:
            return now
        earliest = float("inf")
        for seq in numbers:
            if seq not in self._waiting:
                earliest = min(earliest, max(now, self._reusable_at(seq, command)))
                if earliest <= now:
                    break
        return earliest

    def ask(self, command: Command, *, now: float, timeout: float) -> tuple[int, bytes]:
        """Assign a sequence number and a deadline to a command.

        Args:
            command: what to send.
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
            if seq not in self._waiting and self._reusable_at(seq, command) <= now:
                break
        else:
            raise RuntimeError("every sequence number is in use")
        frame = self._codec.encode_command(command, seq)
        self._next = (numbers.index(seq) + 1) % len(numbers)
        self._forget(now)
        self._settled.pop(self._handle(seq, command.did, command.cid), None)
        self._waiting[seq] = _Waiting(command, frame, now, now + timeout)
        return seq, frame

    def shorten_deadlines(self, numbers: Iterable[int], *, deadline: float) -> None:
        """Set the deadlines of these sequence numbers to this time, if they are later."""
        for seq in numbers:
            waiting = self._waiting.get(seq)
            if waiting and waiting.deadline > deadline:
                self._waiting[seq] = waiting._replace(deadline=deadline)

    def hear(self, data: bytes, *, now: float) -> Iterator[Exchange | Unsolicited]:
        """Process bytes from the robot; return the exchanges that they end and unsolicited packets."""
        self._heard_at = now
        return self._process(self._decoder.feed(data), now)

    def expire(self, *, now: float) -> Iterator[Exchange | Unsolicited]:
        """Yield the commands whose deadline has passed, and first the packets behind an incomplete frame."""
        if now - self._heard_at >= QUIET and self._overdue(now):
            yield from self._process(self._decoder.give_up(), now)
        for seq in self._overdue(now):
            waiting = self._waiting.pop(seq)
            silent = Silent(waiting.command, seq, waiting.sent, now - waiting.at)
            self._settle(silent, now, now + REUSE_AFTER_SILENCE)
            yield silent

    def next_deadline(self) -> float | None:
        """Return the next deadline, None while no command waits."""
        return min([waiting.deadline for waiting in self._waiting.values()], default=None)

    def _overdue(self, now: float) -> list[int]:
        return [seq for seq, waiting in self._waiting.items() if waiting.deadline <= now]

    def _process(self, packets: list[Packet], now: float) -> Iterator[Exchange | Unsolicited]:
        for packet in packets:
            if isinstance(packet, Response):
                yield self._match(packet, now)
            elif isinstance(packet, Notification) and (response := self._tolerated(packet)):
                self.tolerated["they lack the flag of a response"] += 1
                yield self._match(response, now)
            elif isinstance(packet, Notification | Malformed):
                yield packet
            elif isinstance(packet, Request):  # a host's decoder yields none
                yield Malformed(b"", "the robot sent a command")

    def _match(self, response: Response, now: float) -> Answered | LateResponse:
        received = self._codec.frame_of(response)
        named = response.seq
        if "seq" in self._tolerate:
            response = response._replace(seq=self._nearest_seq(response))
        waiting = self._waiting.get(response.seq)
        if waiting and self._fits(response, waiting.command):
            del self._waiting[response.seq]
            if self._tolerate:
                self._count_tolerated(response, named, waiting.command)
            answered = Answered(
                waiting.command, response.seq, waiting.sent, response, received, now - waiting.at
            )
            self._settle(answered, now, now + REUSE_AFTER_ANSWER)
            return answered
        settled = self._settled.get((response.seq, response.did, response.cid))
        if settled and self._fits(response, settled.exchange.command):
            exchange = settled.exchange
            waited = exchange.rtt if isinstance(exchange, Answered) else exchange.waited
            return LateResponse(response, received, exchange, now - settled.at + waited)
        return LateResponse(response, received, None)

    def _count_tolerated(self, response: Response, named: int, command: Command) -> None:
        """Take in how an accepted answer differs from what it should be."""
        if named != response.seq:
            self.tolerated["they carry another sequence number"] += 1
        if not self._is_from(response, command):
            node = node_of(response.source)
            self.tolerated[f"they come from node {node}"] += 1

    def _tolerated(self, packet: Notification) -> Response | None:
        """Return a notification as the response that it stands for if flags are tolerated, else None."""
        seq = packet.seq
        waiting = self._waiting.get(seq) if seq is not None and "flags" in self._tolerate else None
        if (
            waiting is None
            or seq is None
            or (packet.did, packet.cid) != waiting.command[:2]
            or not packet.payload
        ):
            return None
        code, payload = packet.payload[0], packet.payload[1:]
        return Response(
            seq, code, payload, packet.did, packet.cid, packet.source, packet.target, packet.flags
        )

    def _nearest_seq(self, response: Response) -> int:
        """Return the sequence number of the longest waiting command that an answer fits otherwise."""
        if response.seq in self._waiting and self._fits(response, self._waiting[response.seq].command):
            return response.seq
        fitting = (seq for seq, waiting in self._waiting.items() if self._fits(response, waiting.command))
        return next(fitting, response.seq)

    def _handle(self, seq: int, did: int, cid: int) -> _Handle:
        return (seq, did, cid) if self._codec.answers_name_commands else (seq, None, None)

    def _reusable_at(self, seq: int, command: Command) -> float:
        settled = self._settled.get(self._handle(seq, command.did, command.cid))
        return settled.reusable_at if settled else float("-inf")

    def _settle(self, exchange: Answered | Silent, now: float, reusable_at: float) -> None:
        command = exchange.command
        handle = self._handle(exchange.seq, command.did, command.cid)
        self._settled[handle] = _Settled(exchange, now, reusable_at)
        (self._silent if isinstance(exchange, Silent) else self._answered).append((handle, now))

    def _forget(self, now: float) -> None:
        """Forget commands that ended too long ago to be answered now."""
        for order in (self._answered, self._silent):  # a silent one rests longer, and must not hold up others
            while order and (order[0][1] + REUSE_AFTER_SILENCE <= now or len(order) > _REMEMBERED):
                handle, at = order[0]
                settled = self._settled.get(handle)
                if settled and settled.at == at:  # the number was not reused since
                    if settled.reusable_at > now:
                        break
                    del self._settled[handle]
                order.popleft()

    def _fits(self, response: Response, command: Command) -> bool:
        """Compare DID, CID and node, as far as both sides carry them."""
        if (response.did, response.cid) not in ((None, None), (command.did, command.cid)):
            return False
        return "source" in self._tolerate or self._is_from(response, command)

    def _is_from(self, response: Response, command: Command) -> bool:
        """Whether an answer may come from the node that it names."""
        if response.source is None or command.target is None:
            return True
        node = node_of(command.target)
        if node in (WILDCARD, node_of(response.source)):
            return True
        return self._codec.verdict(response.code) in _FROM_ANY_NODE  # another answers for a missing one
