"""Delivers a robot's notifications, decoded, to any number of listeners."""

import asyncio
from collections import deque
from contextlib import ExitStack
from typing import Final, Self
from weakref import WeakSet

from sphero_probe.api.decoding import DecodedPacket
from sphero_probe.errors import LinkLostError
from sphero_probe.link.events import UnsolicitedReceived
from sphero_probe.link.unsolicited import follow_streams
from sphero_probe.protocol.packets import Notification
from sphero_probe.session.session import Session

QUEUE: Final = 1000
"""Most notifications that wait for a listener; a sensor stream sends about 30 per second."""


class Notifications:
    """The notifications of one robot as they arrive, from the moment this object was made.

    An async iterator. It ends when its time is up or the connection is closed. If the listener is too slow,
    the oldest waiting notifications are dropped and counted; the link never waits for a listener.

    Attributes:
        dropped: how many were dropped because the queue was full.
    """

    def __init__(self, queue: int, seconds: float | None) -> None:
        """Start with an empty queue.

        Args:
            queue: how many notifications wait at most.
            seconds: end after this time; None for no end. Needs a running event loop.
        """
        self.dropped = 0
        self._deadline = None if seconds is None else asyncio.get_running_loop().time() + seconds
        self._waiting: deque[DecodedPacket] = deque(maxlen=queue)
        self._changed = asyncio.Event()
        self._ended = False
        self._error: LinkLostError | None = None

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> DecodedPacket:
        """Wait for the next notification.

        Raises:
            LinkLostError: the connection is lost; earlier notifications are returned first.
            StopAsyncIteration: the time is up, or the connection was closed.
        """
        while not self._waiting:
            if self._error:
                raise self._error
            if self._ended:
                raise StopAsyncIteration
            self._changed.clear()
            try:
                async with asyncio.timeout_at(self._deadline):
                    await self._changed.wait()
            except TimeoutError:
                self._ended = True
        return self._waiting.popleft()

    async def aclose(self) -> None:
        """End the iterator and discard the waiting notifications."""
        self._waiting.clear()
        self.end(None)

    def put(self, heard: DecodedPacket) -> None:
        """Add a notification; the dispatcher calls this."""
        if not self._ended:
            self.dropped += len(self._waiting) == self._waiting.maxlen
            self._waiting.append(heard)
            self._changed.set()

    def end(self, error: LinkLostError | None) -> None:
        """End the iterator after the waiting notifications; with an error if the connection is lost."""
        if not self._ended:
            self._ended, self._error = True, error
            self._changed.set()


class Dispatcher:
    """Passes every notification of a session to all listeners; use it as an async context manager.

    It subscribes to the events of the link, which continue after a reconnect.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._listeners: WeakSet[Notifications] = WeakSet()
        self._listening = ExitStack()
        self._stands = asyncio.Event()
        self._watching: asyncio.Task[None] | None = None
        self._closed = False

    async def __aenter__(self) -> Self:
        """Start listening."""
        link = self._session.link
        self._listening.enter_context(follow_streams(link))
        self._listening.enter_context(link.events.subscribe(self._hear, UnsolicitedReceived))
        self.link_stands()
        return self

    async def __aexit__(self, *_: object) -> None:
        """End every listener."""
        self._closed = True
        self._listening.close()
        if self._watching:
            self._watching.cancel()
            await asyncio.wait([self._watching])
        self._end(None)

    def listen(self, queue: int, seconds: float | None) -> Notifications:
        """Return a new listener; it is removed once the caller drops it."""
        made = Notifications(queue, seconds)
        self._listeners.add(made)
        return made

    def link_may_change(self) -> None:
        """Note that a running plan, or a reconnect, may replace a lost link."""
        self._stands.clear()

    def link_stands(self) -> None:
        """Note that nothing replaces a lost link any more."""
        self._stands.set()
        if not self._closed and (self._watching is None or self._watching.done()):
            self._watching = asyncio.create_task(self._watch(), name="link watch")

    def _hear(self, received: UnsolicitedReceived) -> None:
        """Decode a notification and pass it to all listeners; ignore late and malformed frames."""
        unsolicited = received.unsolicited
        if not isinstance(unsolicited, Notification) or not self._listeners:
            return
        connection, streams = self._session.connection, self._session.link.streams
        heard = DecodedPacket.of(unsolicited, connection.generation, connection.robot, streams)
        for listener in tuple(self._listeners):
            listener.put(heard)

    async def _watch(self) -> None:
        """End every listener once the link is lost and nothing can open it again."""
        while True:
            link = self._session.link
            try:
                await link.closed()
            except LinkLostError as error:
                await self._stands.wait()
                if self._session.link is link:
                    self._end(error)
                    return

    def _end(self, error: LinkLostError | None) -> None:
        for listener in tuple(self._listeners):
            listener.end(error)
