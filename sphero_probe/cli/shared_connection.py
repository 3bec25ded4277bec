"""One connection that several commands use in turn, as the lines of a shell do."""

import asyncio
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from typing import Any, Self

from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.session.addressing import address_of
from sphero_probe.session.identity import Identity
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import open_transport


class SharedConnection:
    """Keeps a connection open between commands, on an event loop that outlives them.

    A context manager; within it, ``current`` returns the object, and commands for the same device use its
    connection instead of one of their own.

    Attributes:
        device: the robot's address as it was given.
        streams: what commands told the robot to stream so far, None before it is connected.
    """

    _current: "SharedConnection | None" = None

    def __init__(self, device: str) -> None:
        self.device = device
        self.streams: StreamDecoder | None = None
        self._identity: Identity | None = None
        self._runner = asyncio.Runner()
        self._stack = AsyncExitStack()
        self._connection: Connection | None = None

    @classmethod
    def current(cls) -> "SharedConnection | None":
        """Return the connection that commands share now, None outside of a shell."""
        return cls._current

    def __enter__(self) -> Self:
        """Let commands share the connection; it is opened when the first of them needs it."""
        SharedConnection._current = self
        return self

    def __exit__(self, *_: object) -> None:
        SharedConnection._current = None
        try:
            self._runner.run(self.close())
        finally:
            self._runner.close()

    def run(self, work: Coroutine[Any, Any, None]) -> None:
        """Run a coroutine on the event loop of the connection."""
        self._runner.run(work)

    async def connection(self, options: OpenOptions) -> Connection:
        """Return the connection, which stays open; open it if it is not.

        Args:
            options: how to connect.

        Raises:
            SpheroProbeError: the robot cannot be reached.
        """
        if self._connection is None:
            place = address_of(self.device)
            self._connection = await self._stack.enter_async_context(open_transport(place, options))
            identity = Identity.of(self._connection)
            if identity != self._identity:  # after a lost connection, another robot may be the one nearby
                self._identity = identity
                self.streams = StreamDecoder(self._connection.generation, self._connection.robot)
        return self._connection

    async def close(self) -> None:
        """Close the connection; the next command opens it again."""
        self._connection = None
        stack, self._stack = self._stack, AsyncExitStack()
        await stack.aclose()
