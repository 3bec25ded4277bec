"""Asking several things at once."""

import asyncio
from collections.abc import Coroutine, Iterable
from typing import Any, TypeVar

Answer = TypeVar("Answer")


async def ask_together(asking: Iterable[Coroutine[Any, Any, Answer]]) -> list[Answer]:
    """Ask several things at once; return the answers in the order of the questions.

    Raises:
        Exception: the first that any of them raised; the others are given up.
    """
    tasks = [asyncio.create_task(one) for one in asking]
    try:
        return await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
