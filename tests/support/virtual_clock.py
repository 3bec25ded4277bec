"""An event loop on which time passes without anybody waiting: a coroutine in, its result out."""

import asyncio
import gc
import selectors
from collections.abc import Coroutine
from typing import Any, TypeVar

A_MONTH = 30 * 86400.0
_T = TypeVar("_T")


class _Selector(selectors.DefaultSelector):
    """Instead of waiting for a timer it moves the clock to that timer."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        events = super().select(0)
        if not events:
            if timeout is None:
                raise RuntimeError("everything waits, and no timer is set that could end it")
            self.now += timeout
            if timeout and self.now > A_MONTH:
                raise RuntimeError("nothing happened for a month")
        return events


class VirtualClock(asyncio.SelectorEventLoop):
    """A loop whose clock starts at 0 s and jumps from timer to timer."""

    def __init__(self) -> None:
        self._clock = _Selector()
        super().__init__(self._clock)

    def time(self) -> float:
        return self._clock.now


def run(coroutine: Coroutine[Any, Any, _T]) -> _T:
    """Run a coroutine on a virtual clock and return its result.

    Raises:
        RuntimeError: it waits for what can never happen.
        AssertionError: it left tasks behind, or errors that nobody looked at.
    """
    unseen: list[dict[str, Any]] = []

    async def watched() -> _T:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: unseen.append(context))
        result = await coroutine
        left = asyncio.all_tasks() - {asyncio.current_task()}
        assert not left, f"left behind: {left}"
        gc.collect()
        assert not unseen, unseen
        return result

    with asyncio.Runner(loop_factory=VirtualClock) as runner:
        return runner.run(watched())
