"""A conversation on the event loop: commands in, exchanges out, one reader, one watcher, a pace per node."""

import asyncio
from collections import deque
from collections.abc import Callable, Collection
from math import inf
from types import TracebackType
from typing import Any, Final, Self

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.events import BytesReceived, Events, ExchangeEnded, FrameSent, UnsolicitedReceived
from sphero_probe.link.exchange import Answered, Blocked, Exchange, LateResponse, Silent, Unsolicited
from sphero_probe.link.pacing import FIRST_TIMEOUT, WIDEST, Pace
from sphero_probe.link.policy import Policy
from sphero_probe.link.requests import InFlightCommand, QueuedCommand
from sphero_probe.link.tracker import Tracker
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.transports.base import Transport

_TICK: Final = 1e-6
_CLOSED: Final = "try again, nearer to the robot; one that falls asleep drops the link"


def _ignore(*_: object) -> None:
    pass


class Link:
    """One conversation with one robot; use it as an async context manager.

    Attributes:
        policy: the gate that every command passes.
        frames_sent: how many command frames went out.
        answers: how many responses came, late ones included.
        matched: how many of them belong to a command that was sent.
        limit: commands in flight to a node at most, whatever its pace allows.
        events: told of every frame, exchange and unsolicited packet.
    """

    def __init__(
        self,
        transport: Transport,
        codec: Codec,
        policy: Policy,
        *,
        timeout: float | None = None,
        window: int | None = None,
        events: Events | None = None,
        tolerate: Collection[str] = (),
    ) -> None:
        """Take the two ends of the line and the gate.

        Args:
            transport: to the robot.
            codec: how it speaks.
            policy: what may be sent.
            timeout: seconds until a command counts as silent; None measures it, node by node.
            window: commands in flight; None finds out, node by node, how many the robot takes.
            events: the listeners to tell what happens; None begins without any.
            tolerate: in what an answer may differ and still count, of ``tracker.TOLERANCES``.
        """
        self.policy = policy
        self.codec = codec
        self.frames_sent = self.answers = self.matched = 0
        self.events = events or Events()
        self.limit = window or WIDEST
        self._transport = transport
        self._tracker = Tracker(codec, tolerate)
        self._timeout = timeout
        self._window = window
        self._paces: dict[int | None, Pace] = {}
        self._queue: deque[tuple[QueuedCommand, asyncio.Future[InFlightCommand]]] = deque()
        self._in_flight = 0
        self._someone_alone = False
        self._claims: dict[int, InFlightCommand] = {}
        self._lost: Exception | None = None
        self._reader: asyncio.Task[None] | None = None
        self._watcher: asyncio.TimerHandle | None = None

    async def __aenter__(self) -> Self:
        """Start listening."""
        self._reader = asyncio.create_task(self._read(), name="link reader")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop listening; whoever still waits gets ``LinkLostError``."""
        if self._watcher:
            self._watcher.cancel()
        if self._reader:
            self._reader.cancel()
            await asyncio.wait([self._reader])
        self._lose(LinkLostError("the link was closed"))

    async def closed(self) -> None:
        """Wait until the robot is gone.

        Raises:
            LinkLostError: it is.
        """
        if self._reader:
            await asyncio.wait([self._reader])
        raise self._lost or LinkLostError("the link was closed")

    def pace(self, target: int | None) -> Pace:
        """Return the pace of the node at an address."""
        pace = self._paces.get(target)
        if pace is None:
            pace = self._paces[target] = Pace(self._timeout, self._window)
        return pace

    def room(self, target: int | None) -> int:
        """Return how many more commands would go out to a node at once, were they asked now."""
        if self._queue or self._someone_alone:
            return 0
        pace = self.pace(target)
        return max(0, min(self.limit, pace.window) - pace.in_flight)

    async def ask(
        self,
        command: Command,
        *,
        timeout: float | None = None,
        alone: bool = False,
        expected: bool = False,
        before_sending: Callable[[], None] = _ignore,
    ) -> Exchange:
        """Ask one command and wait for how that ends.

        Args:
            command: what to ask.
            timeout: seconds until it counts as silent, None for the node's pace.
            alone: with nothing else in flight; always so above the ``probe`` class.
            expected: an answer is sure to come, so that silence means that too much was asked at a time.
            before_sending: called when it is about to go out; what it raises keeps it from doing so.

        Returns:
            ``Blocked`` when the guard does not let it out, else ``Answered`` or ``Silent``.

        Raises:
            LinkLostError: the robot is gone.
            ValueError: the command cannot be encoded.
        """
        risk, _, reason = self.policy.assess(command)
        if reason:
            return self._blocked(command, risk, reason)
        timeout = timeout or self._timeout
        if risk > Risk.PROBE:
            alone = True
            timeout = timeout or max(FIRST_TIMEOUT, self.pace(command.target).timeout)
        claim = await self._wait_in_line(QueuedCommand(command, timeout, alone, expected))
        try:
            if reason := self.policy.assess(command).blocked:  # something was measured while it waited
                return self._blocked(command, risk, reason)
            before_sending()
            self.frames_sent += 1
            self.events.tell(FrameSent, asyncio.get_running_loop().time(), claim.frame)
            await self._transport.write(claim.frame)
            return await claim.answer
        except LinkLostError as error:
            self._lose(error)
            raise
        finally:
            self._leave(claim)

    def _blocked(self, command: Command, risk: Risk, reason: str) -> Blocked:
        blocked = Blocked(command, risk, reason)
        self.events.tell(ExchangeEnded, asyncio.get_running_loop().time(), blocked)
        return blocked

    async def _wait_in_line(self, queued: QueuedCommand) -> InFlightCommand:
        """Wait for a place in the window, in the order of asking, and claim a sequence number."""
        if self._lost:
            raise self._lost
        turn: asyncio.Future[InFlightCommand] = asyncio.get_running_loop().create_future()
        self._queue.append((queued, turn))
        self._admit()
        try:
            return await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled() and not turn.exception():
                self._leave(turn.result())
            self._admit()  # he may have held up those behind him
            raise

    def _admit(self) -> None:
        """Let the first in line go while there is a place and a number; who goes alone holds up the rest."""
        loop = asyncio.get_running_loop()
        now = loop.time()  # one moment for the whole look: what is not due by it gets a timer
        while self._queue:
            queued, turn = self._queue[0]
            if turn.done():
                self._queue.popleft()
                continue
            if not self._may_go(queued) or self._tracker.free_at(queued.command, now) > now:
                break
            self._queue.popleft()
            pace = self.pace(queued.command.target)
            timeout = pace.timeout if queued.timeout is None else queued.timeout
            try:
                seq, frame = self._tracker.ask(queued.command, now=now, timeout=timeout)
            except ValueError as error:
                turn.set_exception(error)
                continue
            self._in_flight += 1
            self._someone_alone = queued.alone
            pace.sent(seq, now=now)
            self._claims[seq] = InFlightCommand(seq, frame, queued, loop.create_future())
            turn.set_result(self._claims[seq])
        self._watch(now)

    def _may_go(self, queued: QueuedCommand) -> bool:
        if queued.alone:
            return self._in_flight == 0
        pace = self.pace(queued.command.target)
        return not self._someone_alone and pace.in_flight < min(self.limit, pace.window)

    def _leave(self, claim: InFlightCommand) -> None:
        """Give the place back; an answer that still comes is nobody's."""
        if self._claims.get(claim.seq) is claim:
            del self._claims[claim.seq]
            self.pace(claim.queued.command.target).forget(claim.seq)
        if not claim.answer.cancel() and not claim.answer.cancelled():
            claim.answer.exception()  # seen: it may have come while the write was stuck
        self._in_flight -= 1
        if claim.queued.alone:
            self._someone_alone = False
        self._admit()

    async def _read(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            while data := await self._transport.read():
                now = loop.time()
                self.events.tell(BytesReceived, now, data)
                for event in self._tracker.hear(data, now=now):
                    self._deliver(event, now)
                self._admit()
        except Exception as error:  # noqa: BLE001 - raised again wherever somebody waits
            self._lose(error)
        else:
            self._lose(LinkLostError("the robot closed the connection", _CLOSED))

    def _watch(self, now: float) -> None:
        """Set the one timer to what comes next: a deadline, or a rested number that somebody waits for."""
        if self._watcher:
            self._watcher.cancel()
            self._watcher = None
        loop = asyncio.get_running_loop()
        moments = [self._tracker.next_deadline()]
        if self._queue and (rested := self._tracker.free_at(self._queue[0][0].command, now)) > now:
            moments.append(rested)
        due = min((moment for moment in moments if moment is not None), default=inf)
        if due < inf and not self._lost:
            self._watcher = loop.call_at(max(due, loop.time() + _TICK), self._on_time)

    def _on_time(self) -> None:
        now = asyncio.get_running_loop().time()
        try:
            for event in self._tracker.expire(now=now + _TICK):  # a timer may fire a hair early
                self._deliver(event, now)
        except Exception as error:  # noqa: BLE001 - raised again wherever somebody waits
            self._lose(error)
        self._admit()

    def _deliver(self, event: Exchange | Unsolicited, now: float) -> None:
        self.answers += isinstance(event, Answered | LateResponse)
        self.matched += isinstance(event, Answered) or (
            isinstance(event, LateResponse) and event.earlier is not None
        )
        if isinstance(event, LateResponse) and isinstance(event.earlier, Silent) and event.took is not None:
            self.pace(event.earlier.command.target).answered_late(event.took)
        match event:
            case Answered() | Silent():
                self._settle(event, now)
                self.events.tell(ExchangeEnded, now, event)
            case Blocked():  # never sent, so never heard of
                pass
            case _:
                self.events.tell(UnsolicitedReceived, now, event)

    def _settle(self, event: Answered | Silent, now: float) -> None:
        """Hand out how a command ended, and let its node's pace learn from it."""
        claim = self._claims.pop(event.seq, None)
        pace = self.pace(event.command.target)
        if isinstance(event, Answered):
            busy = self.codec.verdict(event.response.code) is Verdict.BUSY
            overtaken = pace.answered(event.seq, event.rtt, now=now, busy=busy)
            by_pace = [seq for seq in overtaken if seq in self._claims and self._claims[seq].is_paced]
            self._tracker.shorten_deadlines(by_pace, deadline=now + pace.grace)
        else:
            expected = claim is not None and claim.queued.expected
            pace.silent(event.seq, event.waited, now=now, expected=expected)
        if claim and not claim.answer.done():
            claim.answer.set_result(event)

    def _lose(self, error: Exception) -> None:
        """Tell everybody who waits, in line or for an answer."""
        self._lost = self._lost or error
        waiting: list[asyncio.Future[Any]] = [turn for _, turn in self._queue]
        self._queue.clear()
        for future in (*waiting, *(claim.answer for claim in self._claims.values())):
            if not future.done():
                future.set_exception(self._lost)
