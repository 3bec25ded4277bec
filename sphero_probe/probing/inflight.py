"""What is in flight: things to ask and how to ask them go in, how each ended comes out."""

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, Generic, NamedTuple, TypeVar

from sphero_probe.errors import LinkLostError

Item = TypeVar("Item")
Answer = TypeVar("Answer")


class Ended(NamedTuple, Generic[Item, Answer]):
    """How asking one thing ended.

    Attributes:
        item: what was asked.
        stamp: what ``InFlight`` was told to read, read when it was started, and again whenever it was sent
            again; None if it never went out.
        answer: what came of it, or what broke the line under it.
    """

    item: Item
    stamp: int | None
    answer: Answer | LinkLostError


class _Entry(Generic[Item]):
    """One thing in flight."""

    def __init__(self, item: Item, stamp: int) -> None:
        self.item = item
        self.stamp = stamp
        self.sent = False


class InFlight(Generic[Item, Answer]):
    """Things in flight, each asked by a task of its own.

    Attributes:
        waiting: how many were started and have not gone out yet.
    """

    def __init__(self, stamp: Callable[[], int]) -> None:
        """Take what to read each time something goes out."""
        self.waiting = 0
        self._stamp = stamp
        self._tasks: dict[asyncio.Task[None], Item] = {}
        self._ended: list[Ended[Item, Answer]] = []
        self._failure: BaseException | None = None
        self._stirred = asyncio.Event()

    def __len__(self) -> int:
        """Count what is in flight, and what has ended and was not looked at."""
        return len(self._tasks) + len(self._ended)

    @property
    def items(self) -> list[Item]:
        """What is in flight."""
        return list(self._tasks.values())

    def start(self, item: Item, ask: Callable[[Callable[[], None]], Coroutine[Any, Any, Answer]]) -> None:
        """Ask one thing; ``ask`` is given what to call each time it goes out."""
        self.waiting += 1
        flying = _Entry(item, self._stamp())
        task = asyncio.create_task(self._fly(flying, ask))
        self._tasks[task] = item
        task.add_done_callback(partial(self._land, flying))

    async def some(self) -> list[Ended[Item, Answer]]:
        """Wait until something has ended, unless nothing is in flight; return all that has, in order.

        Raises:
            Exception: whatever else than a broken line asking one of them raised.
        """
        while self._tasks and not self._ended and not self._failure:
            self._stirred.clear()
            await self._stirred.wait()
        if self._failure:
            raise self._failure
        ended, self._ended = self._ended, []
        return ended

    async def all(self) -> list[Ended[Item, Answer]]:
        """Wait until everything has ended; return it, in order.

        Raises:
            Exception: whatever else than a broken line asking one of them raised.
        """
        while self._tasks:
            await asyncio.wait(self._tasks)
        return await self.some()

    async def close(self) -> None:
        """Give up what is in flight."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _fly(
        self, flying: "_Entry[Item]", ask: Callable[[Callable[[], None]], Coroutine[Any, Any, Answer]]
    ) -> None:
        def before_sending() -> None:
            if flying.sent:
                flying.stamp = self._stamp()
            else:
                flying.sent = True
                self.waiting -= 1

        try:
            answer: Answer | LinkLostError = await ask(before_sending)
        except LinkLostError as lost:
            answer = lost
        except Exception as error:  # noqa: BLE001 - raised again where the flight is looked after
            self._failure = self._failure or error
            return
        self._ended.append(Ended(flying.item, flying.stamp if flying.sent else None, answer))

    def _land(self, flying: "_Entry[Item]", task: asyncio.Task[None]) -> None:
        """Clear up behind a task, also one that was given up before it began."""
        del self._tasks[task]
        if not flying.sent:
            self.waiting -= 1
        self._stirred.set()
