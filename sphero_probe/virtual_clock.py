"""An event loop on which time passes without waiting, for tests of slow links and of timeouts."""

import asyncio
import selectors
from typing import Final

A_MONTH: Final = 30 * 86400.0
"""Seconds after which a loop on which nothing else happens is given up."""


class _Selector(selectors.DefaultSelector):
    """Instead of waiting for a timer it moves the clock to that timer."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Return what is ready now; where nothing is, let the time until the next timer pass at once."""
        events = super().select(0)
        if not events:
            if timeout is None:
                raise RuntimeError("everything waits, and no timer is set that could end it")
            self.now += timeout
            if timeout and self.now > A_MONTH:
                raise RuntimeError("nothing happened for a month")
        return events


class VirtualClock(asyncio.SelectorEventLoop):
    """A loop whose clock starts at 0 s and jumps from timer to timer.

    Pass it as ``loop_factory`` to ``asyncio.Runner``. It suits what runs in this process, such as the
    built-in robot; real I/O is slower than this clock.
    """

    def __init__(self) -> None:
        self._clock = _Selector()
        super().__init__(self._clock)

    def time(self) -> float:
        """Return the time in seconds."""
        return self._clock.now
