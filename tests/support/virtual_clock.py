"""Runs a coroutine on a virtual clock for a test, and checks that it leaves no tasks behind."""

import asyncio
import gc
from collections.abc import Coroutine
from typing import Any, TypeVar

from sphero_probe.virtual_clock import VirtualClock

T = TypeVar("T")


def run(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine on a virtual clock and return its result.

    Raises:
        RuntimeError: it waits for something that can never happen.
        AssertionError: it left tasks behind, or errors that were never retrieved.
    """
    unseen: list[dict[str, Any]] = []

    async def watched() -> T:
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
