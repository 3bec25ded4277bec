"""Keep several questions to a robot in flight, one task each, and collect how each ended."""

import asyncio
from collections.abc import Callable, Coroutine, ValuesView
from typing import Any, Generic, NamedTuple, TypeVar

from sphero_probe.errors import LinkLostError

Item = TypeVar("Item")
Answer = TypeVar("Answer")


class Ended(NamedTuple, Generic[Item, Answer]):
    """How one item ended.

    Attributes:
        item: the item.
        stamp: the stamp at its start or, if it was sent more than once, when it was last sent; None if it was
            never sent.
        answer: its result, or the error that broke the link.
    """

    item: Item
    stamp: int | None
    answer: Answer | LinkLostError


class _Entry(Generic[Item]):
    """One item in flight."""

    def __init__(self, item: Item, stamp: int) -> None:
        self.item = item
        self.stamp = stamp
        self.sent = False
        self.task: asyncio.Task[None]


class InFlight(Generic[Item, Answer]):
    """Items in flight, each asked by its own task.

    Attributes:
        waiting: how many were started and not sent yet.
    """

    def __init__(self, stamp: Callable[[], int]) -> None:
        """Set the function that returns the stamp of an item that is sent now."""
        self.waiting = 0
        self._stamp = stamp
        self._tasks: dict[asyncio.Task[None], Item] = {}
        self._ended: list[Ended[Item, Answer]] = []
        self._failure: BaseException | None = None
        self._waiter: asyncio.Future[None] | None = None

    def __len__(self) -> int:
        """Count items in flight, and items that ended and were not collected."""
        return len(self._tasks) + len(self._ended)

    @property
    def items(self) -> ValuesView[Item]:
        """The items in flight, as they come and go."""
        return self._tasks.values()

    def start(self, item: Item, ask: Callable[[Callable[[], None]], Coroutine[Any, Any, Answer]]) -> None:
        """Start asking one item; ``ask`` must call its argument each time it sends it."""
        self.waiting += 1
        entry = _Entry(item, self._stamp())
        entry.task = asyncio.create_task(self._run(entry, ask))
        self._tasks[entry.task] = item

    async def wait_any(self) -> list[Ended[Item, Answer]]:
        """Wait until an item has ended, if any is in flight; return all that have, in order of ending.

        Raises:
            Exception: what asking an item raised, other than a lost link.
        """
        while self._tasks and not self._ended and not self._failure:
            self._waiter = asyncio.get_running_loop().create_future()
            await self._waiter
        if self._failure:
            raise self._failure
        ended, self._ended = self._ended, []
        return ended

    async def wait_all(self) -> list[Ended[Item, Answer]]:
        """Wait until every item has ended; return them in order of ending.

        Raises:
            Exception: what asking an item raised, other than a lost link.
        """
        while self._tasks:
            await asyncio.wait(self._tasks)
        return await self.wait_any()

    async def close(self) -> None:
        """Cancel all items in flight."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._tasks.clear()  # one that was cancelled before it began could not remove itself
        self.waiting = 0
        self._wake()

    async def _run(
        self, entry: "_Entry[Item]", ask: Callable[[Callable[[], None]], Coroutine[Any, Any, Answer]]
    ) -> None:
        def before_sending() -> None:
            if entry.sent:
                entry.stamp = self._stamp()
            else:
                entry.sent = True
                self.waiting -= 1

        try:
            answer = await ask(before_sending)
            self._ended.append(Ended(entry.item, entry.stamp if entry.sent else None, answer))
        except LinkLostError as lost:
            self._ended.append(Ended(entry.item, entry.stamp if entry.sent else None, lost))
        except Exception as error:  # noqa: BLE001 - raised again in wait_any and wait_all
            self._failure = self._failure or error
        finally:
            del self._tasks[entry.task]
            if not entry.sent:
                self.waiting -= 1
            self._wake()

    def _wake(self) -> None:
        if self._waiter and not self._waiter.done():
            self._waiter.set_result(None)
