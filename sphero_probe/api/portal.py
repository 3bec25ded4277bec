"""Lets ordinary code use an event loop: run coroutines, iterate, keep a connection open between calls."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Coroutine, Iterator
from contextlib import AbstractAsyncContextManager, contextmanager
from threading import Event, Thread
from typing import Any, Protocol, Self, TypeVar

from sphero_probe.errors import LinkLostError

T = TypeVar("T")


class Runner(Protocol):
    """Runs a coroutine to its end and returns its result; ``asyncio.Runner`` is one."""

    def run(self, coro: Coroutine[Any, Any, T], /) -> T:
        """Run it."""
        ...


class BackgroundLoop:
    """An event loop in a thread of its own; use it as a context manager."""

    def __init__(self) -> None:
        self._ready = Event()
        self._thread = Thread(target=self._serve, name="sphero-probe", daemon=True)

    def __enter__(self) -> Self:
        """Start the thread."""
        self._thread.start()
        self._ready.wait()
        return self

    def __exit__(self, *_: object) -> None:
        """Cancel the tasks that still run, and end the thread."""
        self._loop.call_soon_threadsafe(self._leave.set)
        self._thread.join()

    def run(self, coro: Coroutine[Any, Any, T], /) -> T:
        """Run a coroutine on the loop and wait for its result; an interrupt cancels it."""
        future = asyncio.run_coroutine_threadsafe(coro, self._loop)
        try:
            return future.result()
        except BaseException:
            future.cancel()
            raise

    def _serve(self) -> None:
        async def stay() -> None:
            self._loop, self._leave = asyncio.get_running_loop(), asyncio.Event()
            self._ready.set()
            await self._leave.wait()

        asyncio.run(stay())


class Portal:
    """Runs coroutines on a connection's event loop, until the connection is closed."""

    def __init__(self, runner: Runner) -> None:
        """Use a runner, which runs the loop."""
        self._runner = runner
        self._closed = False

    def run(self, coro: Coroutine[Any, Any, T], /) -> T:
        """Run a coroutine on the loop and wait for its result.

        Raises:
            LinkLostError: the connection was closed.
        """
        if self._closed:
            coro.close()
            raise LinkLostError("the connection was closed", "use the robot inside the with block")
        return self._runner.run(coro)

    def iterate(self, source: AsyncIterator[T]) -> Iterator[T]:
        """Yield what an async iterator yields; leaving the loop early closes it."""

        async def step() -> T:
            return await anext(source)

        try:
            while True:
                try:
                    item = self.run(step())
                except StopAsyncIteration:
                    return
                yield item
        finally:
            close = getattr(source, "aclose", None)
            if close and not self._closed:  # closing the connection has closed it already
                self.run(_awaited(close()))

    @contextmanager
    def entered(self, context: AbstractAsyncContextManager[T]) -> Iterator[T]:
        """Enter an async context manager, and leave it in the same task; then the portal is closed.

        Args:
            context: the context manager; it does not receive the errors of the block.
        """
        leave = asyncio.Event()

        async def hold(opened: asyncio.Future[T]) -> None:
            async with context as value:
                opened.set_result(value)
                await leave.wait()

        async def enter() -> tuple[T, asyncio.Task[None]]:
            opened: asyncio.Future[T] = asyncio.get_running_loop().create_future()
            holding = asyncio.create_task(hold(opened), name="connection")
            try:
                both: set[asyncio.Future[Any]] = {opened, holding}
                await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            except asyncio.CancelledError:
                holding.cancel()
                await asyncio.wait({holding})
                raise
            if holding.done():
                holding.result()
            return opened.result(), holding

        async def leave_it() -> None:
            leave.set()
            await holding

        value, holding = self.run(enter())
        try:
            yield value
        finally:
            try:
                self.run(leave_it())
            finally:
                self._closed = True


async def _awaited(what: Awaitable[T]) -> T:
    return await what
