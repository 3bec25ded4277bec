"""An event loop whose time passes without waiting, for tests of slow links and of timeouts."""

import asyncio
import selectors
from typing import Final

A_MONTH: Final = 30 * 86400.0
"""Seconds of virtual time after which the loop raises an error."""


class _Selector(selectors.DefaultSelector):
    """Does not wait for the next timer, but moves the clock to it."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Return the events that are ready; if there are none, move the clock to the next timer."""
        events = super().select(0)
        if not events:
            if timeout is None:
                raise RuntimeError("every task waits, and no timer is set")
            self.now += timeout
            if timeout and self.now > A_MONTH:
                raise RuntimeError("nothing happened for a month")
        return events


class VirtualClock(asyncio.SelectorEventLoop):
    """A loop whose clock starts at 0 s and jumps from timer to timer.

    Pass it as ``loop_factory`` to ``asyncio.Runner``. Use it with code that runs in this process, such
    as the built-in robot; real I/O is slower than this clock.
    """

    def __init__(self) -> None:
        self._clock = _Selector()
        super().__init__(self._clock)

    def time(self) -> float:
        """Return the time in seconds."""
        return self._clock.now
