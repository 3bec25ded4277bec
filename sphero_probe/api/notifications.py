"""Notifications of a robot, decoded, for any number of listeners at once."""

import asyncio
from collections import deque
from dataclasses import replace
from typing import Final, Self
from weakref import WeakSet

from sphero_probe.api.decoding import DecodedPacket
from sphero_probe.catalogue.sensors import STREAM_IDS, Masks, masks_after, streaming_fields
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Unsolicited
from sphero_probe.protocol.packets import Command, Notification
from sphero_probe.session.session import Session

QUEUE: Final = 1000
"""Notifications that wait for a listener; a sensor stream sends some 30 a second."""


class Notifications:
    """The notifications of one robot as they arrive, from the moment this object was made.

    An async iterator. It ends when its time is up or the connection is left. Where the listener is too slow,
    the oldest waiting notifications are dropped and counted; the link never waits for a listener.

    Attributes:
        dropped: how many were dropped because the queue was full.
    """

    def __init__(self, queue: int, seconds: float | None) -> None:
        """Start with an empty queue.

        Args:
            queue: how many notifications wait at most.
            seconds: when to end, counted from now; None for no end. Needs a running event loop.
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
            LinkLostError: the robot is gone; what came before that was returned first.
            StopAsyncIteration: the time is up, or the connection was left.
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
        """End it; what is waiting is forgotten."""
        self._waiting.clear()
        self.end(None)

    def put(self, heard: DecodedPacket) -> None:
        """Take in a notification; called by the link's side."""
        if not self._ended:
            self.dropped += len(self._waiting) == self._waiting.maxlen
            self._waiting.append(heard)
            self._changed.set()

    def end(self, error: LinkLostError | None) -> None:
        """Let it end after what is waiting; with an error where the robot is gone."""
        if not self._ended:
            self._ended, self._error = True, error
            self._changed.set()


class Dispatcher:
    """Hands every notification of a session to all who listen; use it as an async context manager.

    A link has one callback, which a running plan takes for itself. ``_share`` is the only place that knows
    this: it hears what comes beside the plan.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._listeners: WeakSet[Notifications] = WeakSet()
        self._masks = Masks()
        self._free = asyncio.Event()
        self._free.set()
        self._watching: asyncio.Task[None] | None = None
        self._closed = False

    async def __aenter__(self) -> Self:
        """Start listening."""
        self.release()
        return self

    async def __aexit__(self, *_: object) -> None:
        """Let every listener end."""
        self._closed = True
        if self._watching:
            self._watching.cancel()
            await asyncio.wait([self._watching])
        self._end(None)

    def listen(self, queue: int, seconds: float | None) -> Notifications:
        """Return a new listener; it is forgotten once the caller drops it."""
        made = Notifications(queue, seconds)
        self._listeners.add(made)
        return made

    def borrow(self) -> None:
        """Take in that a plan starts, or a reconnect: the link may change, and its callback is taken."""
        self._free.clear()
        asyncio.get_running_loop().call_soon(self._share)

    def release(self) -> None:
        """Take back the callback of the link that there is now."""
        self._session.link.on_unsolicited = self._hear
        self._free.set()
        if not self._closed and (self._watching is None or self._watching.done()):
            self._watching = asyncio.create_task(self._watch(), name="link watch")

    def _share(self) -> None:
        link = self._session.link
        other = link.on_unsolicited
        if self._free.is_set() or other == self._hear:
            return

        def both(unsolicited: Unsolicited) -> None:
            self._hear(unsolicited)
            other(unsolicited)

        link.on_unsolicited = both

    def executed(self, command: Command) -> None:
        """Take in that the robot executed a command, which may have switched on a sensor stream."""
        self._masks = masks_after(self._session.connection.generation, self._masks, command)

    def _hear(self, unsolicited: Unsolicited) -> None:
        """Decode a notification and hand it to all who listen; ignore late and malformed frames."""
        if not isinstance(unsolicited, Notification) or not self._listeners:
            return
        connection = self._session.connection
        heard = DecodedPacket.of(unsolicited, connection.generation, connection.robot)
        if (unsolicited.did, unsolicited.cid) == STREAM_IDS[connection.generation]:
            decoded = streaming_fields(connection.generation, self._masks, unsolicited.payload)
            if decoded.fields:
                heard = replace(heard, fields=decoded.fields, units=decoded.units, note=decoded.problem)
        for listener in tuple(self._listeners):
            listener.put(heard)

    async def _watch(self) -> None:
        """Let every listener end once the link is lost and no running plan can open it again."""
        while True:
            link = self._session.link
            try:
                await link.closed()
            except LinkLostError as error:
                await self._free.wait()
                if self._session.link is link:
                    self._end(error)
                    return

    def _end(self, error: LinkLostError | None) -> None:
        for listener in tuple(self._listeners):
            listener.end(error)
