"""Send commands to one robot and wait for their answers, as fast as each of its nodes takes them."""

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Collection
from math import inf
from types import TracebackType
from typing import Any, Final, Self

from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.errors import LinkLostError
from sphero_probe.link.alarm import TICK, Alarm
from sphero_probe.link.events import BytesReceived, Events, ExchangeEnded, FrameSent, UnsolicitedReceived
from sphero_probe.link.exchange import Answered, Blocked, Exchange, LateResponse, Silent, Unsolicited
from sphero_probe.link.pacing import FIRST_TIMEOUT, Pace
from sphero_probe.link.policy import Policy
from sphero_probe.link.requests import InFlightCommand, QueuedCommand
from sphero_probe.link.tracker import Tracker
from sphero_probe.link.window import Window
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.transports.base import Transport

_CLOSED: Final = "try again, nearer to the robot; a robot that falls asleep drops the link"


class Link:
    """One conversation with one robot; use it as an async context manager.

    Attributes:
        policy: the gate that every command passes.
        frames_sent: how many command frames were sent.
        answers: how many responses arrived, late ones included.
        matched: how many of them belong to a command that was sent.
        window: how many commands may be in flight.
        events: tells listeners every frame, exchange and unsolicited packet.
        streams: names sensor values by what the robot was told to stream, also over earlier links.
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
        streams: StreamDecoder | None = None,
    ) -> None:
        """Set up a link; entering it starts listening.

        Args:
            transport: to the robot.
            codec: of its protocol.
            policy: what may be sent.
            timeout: seconds until a command counts as silent; None measures it, node by node.
            window: commands in flight; None adapts it, node by node, to what the robot takes.
            events: the listeners; None starts without any.
            tolerate: the fields in which an answer may differ and still count, of ``tracker.TOLERANCES``.
            streams: of an earlier link to this robot; None begins with a robot that streams nothing.
        """
        self.policy, self.codec = policy, codec
        self.frames_sent = self.answers = self.matched = 0
        self.events = events or Events()
        self.streams = streams or StreamDecoder(codec.generation, policy.robot)
        self.window = Window(timeout, window)
        self._transport = transport
        self._tracker = Tracker(codec, tolerate)
        self._timeout = timeout
        self._queue: deque[tuple[QueuedCommand, asyncio.Future[InFlightCommand]]] = deque()
        self._in_flight: dict[int, InFlightCommand] = {}
        self._lost: Exception | None = None
        self._reader: asyncio.Task[None] | None = None
        self._alarm = Alarm(self._on_time)

    async def __aenter__(self) -> Self:
        """Start listening."""
        self._reader = asyncio.create_task(self._read(), name="link reader")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop listening; commands that still wait raise ``LinkLostError``."""
        self._alarm.cancel()
        if self._reader:
            self._reader.cancel()
            await asyncio.wait([self._reader])
        self._fail(LinkLostError("the link was closed"))

    async def closed(self) -> None:
        """Wait until the link is lost.

        Raises:
            LinkLostError: it was lost.
        """
        if self._reader:
            await asyncio.wait([self._reader])
        raise self._lost or LinkLostError("the link was closed")

    @property
    def tolerated(self) -> Counter[str]:
        """How accepted answers differ from what they should be, in words -> how many did."""
        return self._tracker.tolerated

    def pace(self, target: int | None) -> Pace:
        """Return the pace of the node at an address."""
        return self.window.pace(target)

    def room(self, target: int | None) -> int:
        """Return how many more commands could be sent to a node right now."""
        if self._queue and not self.window.has_place(self._queue[0][0]):
            return 0
        return self.window.room(target)

    async def ask(
        self,
        command: Command,
        *,
        timeout: float | None = None,
        alone: bool = False,
        expected: bool | None = None,
        patience: float = 0.0,
        before_sending: Callable[[], None] | None = None,
    ) -> Exchange:
        """Send one command and wait until it is answered, silent or blocked.

        Args:
            command: what to send.
            timeout: seconds until it counts as silent, None for the node's pace.
            alone: send it with nothing else in flight; classes above ``probe`` are always sent like that.
            expected: an answer is certain, so silence means that too many commands were in flight; False if
                silence is likely, so it means nothing.
            patience: seconds that it waits at least, though a later command is answered meanwhile.
            before_sending: called right before the frame is sent; if it raises, nothing is sent.

        Returns:
            ``Blocked`` when the policy blocks it, else ``Answered`` or ``Silent``.

        Raises:
            LinkLostError: the link was lost.
            ValueError: the command cannot be encoded.
        """
        risk, _, reason = self.policy.assess(command)
        if reason:
            return self._blocked(command, risk, reason)
        timeout = timeout or self._timeout
        if risk > Risk.PROBE:
            alone = True
            timeout = timeout or max(FIRST_TIMEOUT, self.pace(command.target).timeout)
        in_flight = await self._wait_for_place(QueuedCommand(command, timeout, alone, expected, patience))
        try:
            if reason := self.policy.assess(command).blocked:  # a measurement may have ended while it waited
                return self._blocked(command, risk, reason)
            if before_sending:
                before_sending()
            self.frames_sent += 1
            self.events.tell(FrameSent, asyncio.get_running_loop().time(), in_flight.frame)
            await self._transport.write(in_flight.frame)
            return await in_flight.answer
        except LinkLostError as error:
            self._fail(error)
            raise
        finally:
            self._release(in_flight)

    def _blocked(self, command: Command, risk: Risk, reason: str) -> Blocked:
        blocked = Blocked(command, risk, reason)
        self.events.tell(ExchangeEnded, asyncio.get_running_loop().time(), blocked)
        return blocked

    async def _wait_for_place(self, queued: QueuedCommand) -> InFlightCommand:
        """Queue a command until the window has a place for it; return it with its sequence number."""
        if self._lost:
            raise self._lost
        if not self._queue and (in_flight := self._place(queued, asyncio.get_running_loop().time())):
            return in_flight
        place: asyncio.Future[InFlightCommand] = asyncio.get_running_loop().create_future()
        self._queue.append((queued, place))
        self._admit()
        try:
            return await place
        except asyncio.CancelledError:
            if place.done() and not place.cancelled() and not place.exception():
                self._release(place.result())
            self._admit()  # it may have held up the rest of the queue
            raise

    def _admit(self) -> None:
        """Give queued commands their places; one to be sent alone holds up the rest of the queue."""
        now = asyncio.get_running_loop().time() if self._queue else 0.0
        while self._queue:
            queued, place = self._queue[0]
            if not place.done():
                try:
                    in_flight = self._place(queued, now)
                except ValueError as error:
                    place.set_exception(error)
                else:
                    if in_flight is None:
                        break
                    place.set_result(in_flight)
            self._queue.popleft()

    def _place(self, queued: QueuedCommand, now: float) -> InFlightCommand | None:
        """Give a command its place and its sequence number; return None if it must wait for either."""
        if not self.window.has_place(queued):
            return None
        ready = max(self._tracker.free_at(queued.command, now), self.window.ready_at(queued))
        if ready > now:
            self._alarm.set(ready)
            return None
        pace, timeout = self.pace(queued.command.target), queued.timeout
        timeout = max(pace.timeout, queued.patience) if timeout is None else timeout
        seq, frame = self._tracker.ask(queued.command, now=now, timeout=timeout)
        self.window.take(queued)
        pace.sent(seq, now=now, doubtful=queued.expected is False)
        in_flight = self._in_flight[seq] = InFlightCommand(seq, frame, queued, asyncio.Future(), now)
        self._alarm.set(now + timeout)
        return in_flight

    def _release(self, in_flight: InFlightCommand) -> None:
        """Free a command's place; an answer that arrives later belongs to no waiting command."""
        if self._in_flight.get(in_flight.seq) is in_flight:
            del self._in_flight[in_flight.seq]
            self.pace(in_flight.queued.command.target).forget(in_flight.seq)
        if not in_flight.answer.cancel() and not in_flight.answer.cancelled():
            in_flight.answer.exception()  # retrieve it: the command may have failed while the write was stuck
        self.window.free(in_flight.queued)
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
        except Exception as error:  # noqa: BLE001 - raised again in every waiting call
            self._fail(error)
        else:
            self._fail(LinkLostError("the robot closed the connection", _CLOSED))

    def _on_time(self) -> None:
        now = asyncio.get_running_loop().time()
        try:
            for event in self._tracker.expire(now=now + TICK):  # a timer may fire a hair early
                self._deliver(event, now)
        except Exception as error:  # noqa: BLE001 - raised again in every waiting call
            self._fail(error)
        if not self._lost:
            self._alarm.set(self._tracker.next_deadline() or inf)
        self._admit()

    def _deliver(self, event: Exchange | Unsolicited, now: float) -> None:
        if isinstance(event, (Answered, Silent)):  # a union of classes would be slow
            self._settle(event, now)
        elif not isinstance(event, Blocked):  # what is blocked is never sent, so the tracker never reports it
            if isinstance(event, LateResponse):
                self.answers += 1
                self.matched += event.earlier is not None
                if isinstance(event.earlier, Silent) and event.took is not None:
                    self.pace(event.earlier.command.target).answered_late(event.earlier.seq, event.took)
            self.events.tell(UnsolicitedReceived, now, event)

    def _settle(self, event: Answered | Silent, now: float) -> None:
        """Return how a command ended to its caller, and adapt the pace of its node."""
        in_flight = self._in_flight.pop(event.seq, None)
        pace = self.pace(event.command.target)
        if isinstance(event, Answered):
            self.answers += 1
            self.matched += 1
            busy = self.codec.verdict(event.response.code) is Verdict.BUSY
            overtaken = pace.answered(event.seq, event.rtt, now=now, busy=busy)
            for waiting in filter(None, map(self._in_flight.get, overtaken)):
                deadline = waiting.deadline_when_overtaken(now + pace.grace)
                self._tracker.shorten_deadlines([waiting.seq], deadline=deadline)
                self._alarm.set(deadline)
        elif not event.command.options.wants_answer:
            pace.forget(event.seq)
        else:
            expected = in_flight is not None and in_flight.queued.expected is True
            pace.silent(event.seq, event.waited, now=now, expected=expected)
        if in_flight and not in_flight.answer.done():
            in_flight.answer.set_result(event)
        self.events.tell(ExchangeEnded, now, event)

    def _fail(self, error: Exception) -> None:
        """Raise the error in every call that waits for a place or for an answer."""
        self._lost = self._lost or error
        waiting: list[asyncio.Future[Any]] = [place for _, place in self._queue]
        self._queue.clear()
        for future in (*waiting, *(in_flight.answer for in_flight in self._in_flight.values())):
            if not future.done():
                future.set_exception(self._lost)
