"""A conversation on the event loop: commands in, exchanges out, one reader, one watcher, a window."""

import asyncio
from collections import deque
from collections.abc import Callable
from math import inf
from types import TracebackType
from typing import Any, Final, NamedTuple, Self

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered, Aside, Exchange, Refused, Silent
from sphero_probe.link.guard import Guard
from sphero_probe.link.tracker import Tracker
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command
from sphero_probe.transports.base import Transport

WINDOW: Final = 4
"""Commands in flight at most: what every robot's queue is known to bear."""
TIMEOUT: Final = 1.0
"""Seconds until a command counts as silent, unless the caller says otherwise."""


_TICK: Final = 1e-6


class _Claim(NamedTuple):
    """A place in the window with a sequence number: the frame to send and where its answer will be."""

    seq: int
    frame: bytes
    answer: "asyncio.Future[Exchange]"


class _Waiter(NamedTuple):
    """Who waits in line for a place."""

    command: Command
    timeout: float
    alone: bool
    turn: "asyncio.Future[_Claim]"


def _ignore(_: Aside) -> None:
    pass


class Link:
    """One conversation with one robot; use it as an async context manager.

    Attributes:
        guard: the gate that every command passes.
        frames_sent: how many command frames went out.
        window: commands in flight at most.
    """

    def __init__(
        self,
        transport: Transport,
        codec: Codec,
        guard: Guard,
        *,
        timeout: float = TIMEOUT,
        window: int = WINDOW,
        on_aside: Callable[[Aside], None] = _ignore,
    ) -> None:
        self.guard = guard
        self.codec = codec
        self.frames_sent = 0
        self.on_aside = on_aside
        self.window = window
        self._transport = transport
        self._tracker = Tracker(codec)
        self._timeout = timeout
        self._queue: deque[_Waiter] = deque()
        self._in_flight = 0
        self._someone_alone = False
        self._answers: dict[int, asyncio.Future[Exchange]] = {}
        self._lost: LinkLostError | None = None
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

    async def ask(
        self,
        command: Command,
        *,
        timeout: float | None = None,
        alone: bool = False,
    ) -> Exchange:
        """Ask one command and wait for how that ends.

        Args:
            command: what to ask.
            timeout: seconds until it counts as silent.
            alone: with nothing else in flight; always so above the ``probe`` class.

        Returns:
            ``Refused`` when the guard does not let it out, else ``Answered`` or ``Silent``.

        Raises:
            LinkLostError: the robot is gone.
            ValueError: the command cannot be encoded.
        """
        if reason := self.guard.why_not(command):
            return Refused(command, self.guard.assess(command).risk, reason)
        alone = alone or self.guard.assess(command).risk > Risk.PROBE
        claim = await self._wait_in_line(command, timeout or self._timeout, alone=alone)
        try:
            self.frames_sent += 1
            await self._transport.write(claim.frame)
            return await claim.answer
        except LinkLostError as error:
            self._lose(error)
            raise
        finally:
            self._leave(claim)

    async def _wait_in_line(self, command: Command, timeout: float, *, alone: bool) -> _Claim:
        """Wait for a place in the window, in the order of asking, and claim a sequence number."""
        if self._lost:
            raise self._lost
        waiter = _Waiter(command, timeout, alone, asyncio.get_running_loop().create_future())
        self._queue.append(waiter)
        self._admit()
        try:
            return await waiter.turn
        except asyncio.CancelledError:
            if waiter.turn.done() and not waiter.turn.cancelled() and not waiter.turn.exception():
                self._leave(waiter.turn.result())
            self._admit()  # he may have held up those behind him
            raise

    def _admit(self) -> None:
        """Let the first in line go while there is a place and a number; who goes alone holds up the rest."""
        loop = asyncio.get_running_loop()
        now = loop.time()  # one moment for the whole look: what is not due by it gets a timer
        while self._queue:
            command, timeout, alone, turn = self._queue[0]
            if turn.done():
                self._queue.popleft()
                continue
            limit = 1 if alone else self.window
            if self._someone_alone or self._in_flight >= limit or self._tracker.free_at(now) > now:
                break
            self._queue.popleft()
            try:
                seq, frame = self._tracker.ask(command, now=now, timeout=timeout)
            except ValueError as error:
                turn.set_exception(error)
                continue
            self._in_flight += 1
            self._someone_alone = alone
            self._answers[seq] = loop.create_future()
            turn.set_result(_Claim(seq, frame, self._answers[seq]))
        self._watch(now)

    def _leave(self, claim: _Claim) -> None:
        """Give the place back; an answer that still comes is nobody's."""
        self._answers.pop(claim.seq, None)
        if not claim.answer.cancel() and not claim.answer.cancelled():
            claim.answer.exception()  # seen: it may have come while the write was stuck
        self._in_flight -= 1
        self._someone_alone = False
        self._admit()

    async def _read(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            while data := await self._transport.read():
                for event in self._tracker.hear(data, now=loop.time()):
                    self._deliver(event)
                self._admit()
        except LinkLostError as error:
            self._lose(error)
        else:
            self._lose(LinkLostError("the robot closed the connection"))

    def _watch(self, now: float) -> None:
        """Set the one timer to what comes next: a deadline, or a rested number that somebody waits for."""
        if self._watcher:
            self._watcher.cancel()
            self._watcher = None
        loop = asyncio.get_running_loop()
        moments = [self._tracker.next_deadline()]
        if self._queue and (rested := self._tracker.free_at(now)) > now:
            moments.append(rested)
        due = min((moment for moment in moments if moment is not None), default=inf)
        if due < inf and not self._lost:
            self._watcher = loop.call_at(max(due, loop.time() + _TICK), self._on_time)

    def _on_time(self) -> None:
        now = asyncio.get_running_loop().time() + _TICK  # a timer may fire a hair early
        for event in self._tracker.expire(now=now):
            self._deliver(event)
        self._admit()

    def _deliver(self, event: Exchange | Aside) -> None:
        if isinstance(event, Answered | Silent):
            answer = self._answers.get(event.seq)
            if answer and not answer.done():
                answer.set_result(event)
        elif not isinstance(event, Refused):
            self.on_aside(event)

    def _lose(self, error: LinkLostError) -> None:
        """Tell everybody who waits, in line or for an answer."""
        self._lost = self._lost or error
        waiting: list[asyncio.Future[Any]] = [waiter.turn for waiter in self._queue]
        self._queue.clear()
        for future in (*waiting, *self._answers.values()):
            if not future.done():
                future.set_exception(self._lost)
