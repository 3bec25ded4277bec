"""Run several coroutines that ask a robot at once."""

import asyncio
from collections.abc import Coroutine, Iterable
from typing import Any, TypeVar

Answer = TypeVar("Answer")


async def ask_together(coroutines: Iterable[Coroutine[Any, Any, Answer]]) -> list[Answer]:
    """Run the coroutines together; return their results in the order given.

    Raises:
        Exception: the first that any of them raised; the others are cancelled.
    """
    tasks = [asyncio.create_task(coroutine) for coroutine in coroutines]
    try:
        return await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
