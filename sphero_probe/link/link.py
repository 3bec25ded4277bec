"""A conversation on the event loop: commands in, exchanges out, one reader, one watcher, a window."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from types import TracebackType
from typing import Final, Self

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
        self._transport = transport
        self._tracker = Tracker(codec)
        self._timeout = timeout
        self.window = window
        self._in_flight = 0
        self._someone_alone = False
        self._place_freed = asyncio.Condition()
        self._futures: dict[int, asyncio.Future[Exchange]] = {}
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
        async with self._place(alone=alone):
            seq, frame = await self._claim(command, timeout or self._timeout)
            future: asyncio.Future[Exchange] = asyncio.get_running_loop().create_future()
            self._futures[seq] = future
            self._watch()
            self.frames_sent += 1
            try:
                await self._transport.write(frame)
                return await future
            except LinkLostError as error:
                self._futures.pop(seq, None)
                self._lose(error)
                raise
            finally:
                self._futures.pop(seq, None)

    @asynccontextmanager
    async def _place(self, *, alone: bool) -> AsyncIterator[None]:
        """Wait for a place in the window, or for the whole of it."""
        async with self._place_freed:
            await self._place_freed.wait_for(
                lambda: not self._someone_alone and self._in_flight < (1 if alone else self.window)
            )
            self._in_flight += 1
            self._someone_alone = alone
        try:
            yield
        finally:
            async with self._place_freed:
                self._in_flight -= 1
                self._someone_alone = False
                self._place_freed.notify_all()

    async def _claim(self, command: Command, timeout: float) -> tuple[int, bytes]:
        """Claim a sequence number; when all rest, wait for the first that is rested."""
        loop = asyncio.get_running_loop()
        while True:
            if self._lost:
                raise self._lost
            free_at = self._tracker.free_at(loop.time())
            if free_at <= loop.time():
                return self._tracker.ask(command, now=loop.time(), timeout=timeout)
            await asyncio.sleep(free_at - loop.time())

    async def _read(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            while data := await self._transport.read():
                for event in self._tracker.hear(data, now=loop.time()):
                    self._deliver(event)
                self._watch()
        except LinkLostError as error:
            self._lose(error)
        else:
            self._lose(LinkLostError("the robot closed the connection"))

    def _watch(self) -> None:
        """Set the one timer to the next deadline."""
        if self._watcher:
            self._watcher.cancel()
        deadline = self._tracker.next_deadline()
        loop = asyncio.get_running_loop()
        self._watcher = None if deadline is None else loop.call_at(deadline, self._expire)

    def _expire(self) -> None:
        # the clock's resolution may let the timer fire a hair early: look a microsecond ahead
        now = asyncio.get_running_loop().time() + 1e-6
        for event in self._tracker.expire(now=now):
            self._deliver(event)
        self._watch()

    def _deliver(self, event: Exchange | Aside) -> None:
        if isinstance(event, Answered | Silent):
            future = self._futures.get(event.seq)
            if future and not future.done():
                future.set_result(event)
        elif not isinstance(event, Refused):
            self.on_aside(event)

    def _lose(self, error: LinkLostError) -> None:
        self._lost = self._lost or error
        for future in self._futures.values():
            if not future.done():
                future.set_exception(self._lost)
