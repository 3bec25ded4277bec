"""Handles Ctrl-C and SIGTERM: the first ends a command cleanly, the second at once.

A run whose parent process is gone ends like one that got SIGHUP.
"""

import asyncio
import os
import signal
from collections.abc import Coroutine
from types import FrameType
from typing import Any, Final

from sphero_probe.cli.messages import say
from sphero_probe.cli.parent import parent_gone
from sphero_probe.cli.shared_connection import SharedConnection
from sphero_probe.errors import InterruptedRunError, LinkLostError

_SIGNALS: Final = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM") if hasattr(signal, name))
_HANGUP: Final = 1
"""The number of SIGHUP, which Windows does not have."""


class Interrupts:
    """The signals that reach a running command.

    Attributes:
        number: of the first signal, None before one arrives.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self._waiting = 0
        self._stop: asyncio.Event | None = None
        self._task: asyncio.Task[Any] | None = None

    def stop_politely(self, stop: asyncio.Event) -> None:
        """Let the first signal set this event instead of cancelling the command."""
        self._stop = stop

    async def guard(self, work: Coroutine[Any, Any, None]) -> None:
        """Run the work with signals handled.

        Raises:
            InterruptedRunError: a signal ended it.
        """
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(_on_orphan)
        self._task = asyncio.current_task()
        handled = []
        for number in _SIGNALS:
            try:
                loop.add_signal_handler(number, self._on_signal, number)
            except (NotImplementedError, RuntimeError, ValueError):
                continue  # Windows: the interpreter's own KeyboardInterrupt
            signal.signal(number, self._on_arrival)
            handled.append(number)
        watching = asyncio.create_task(self._watch_parent(), name="parent watcher")
        try:
            await work
        except (asyncio.CancelledError, LinkLostError):  # a link that is not opened again after a signal
            if self.number is None:
                raise
        finally:
            watching.cancel()
            for number in handled:
                loop.remove_signal_handler(number)
        if self.number is not None:
            raise InterruptedRunError(self.number)

    def _on_arrival(self, number: int, _frame: FrameType | None) -> None:
        """Count a signal as it arrives; the event loop learns of it by itself.

        Where the loop did not get to the last one, a write blocks: standard output is a pipe that is full.
        """
        self._waiting += 1
        if self._waiting > 1:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)

    async def _watch_parent(self) -> None:
        await parent_gone()
        say("the program that started this one is gone")
        self._on_signal(_HANGUP)

    def _on_signal(self, number: int) -> None:
        self._waiting = 0
        first = self.number is None
        self.number = self.number or number
        if first and self._stop is not None:
            self._stop.set()
            say("stopping after the commands in flight; press Ctrl-C again to stop at once")
        elif self._task:
            self._task.cancel()


def _on_orphan(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Ignore the errors that a closing D-Bus connection leaves in abandoned futures."""
    if not isinstance(context.get("exception"), OSError | EOFError):
        loop.default_exception_handler(context)


def run_interruptible(interrupts: Interrupts, work: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine to its end on a fresh event loop, or on that of the connection that commands share.

    Raises:
        InterruptedRunError: a signal ended it.
    """
    shared = SharedConnection.current()
    (shared.run if shared else asyncio.run)(interrupts.guard(work))
