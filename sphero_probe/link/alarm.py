"""A timer of the event loop that is set again and again, and seldom has to be replaced."""

import asyncio
from collections.abc import Callable
from math import inf
from typing import Final

TICK: Final = 1e-6
"""Seconds by which a timer may ring too early."""


class Alarm:
    """Calls back once a time has come, or earlier: then it must be set again."""

    def __init__(self, ring: Callable[[], None]) -> None:
        """Set what is called."""
        self._ring = ring
        self._timer: asyncio.TimerHandle | None = None

    def set(self, due: float) -> None:
        """Ring at this time on the event loop's clock at the latest; infinity is never."""
        if self._timer and self._timer.when() <= due:
            return
        self.cancel()
        if due < inf:
            loop = asyncio.get_running_loop()
            self._timer = loop.call_at(max(due, loop.time() + TICK), self._on_time)

    def cancel(self) -> None:
        """Do not ring."""
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _on_time(self) -> None:
        self._timer = None
        self._ring()
