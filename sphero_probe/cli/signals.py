"""Handles Ctrl-C and SIGTERM: the first ends a command cleanly, the second at once."""

import asyncio
import signal
from collections.abc import Coroutine
from typing import Any, Final

from sphero_probe.cli.messages import say
from sphero_probe.errors import InterruptedRunError

_SIGNALS: Final = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM") if hasattr(signal, name))


class Interrupts:
    """The signals that reach a running command.

    Attributes:
        number: of the first signal, None before one arrives.
    """

    def __init__(self) -> None:
        self.number: int | None = None
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
            handled.append(number)
        try:
            await work
        except asyncio.CancelledError:
            if self.number is None:
                raise
        finally:
            for number in handled:
                loop.remove_signal_handler(number)
        if self.number is not None:
            raise InterruptedRunError(self.number)

    def _on_signal(self, number: int) -> None:
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
    """Run a coroutine to its end on a fresh event loop.

    Raises:
        InterruptedRunError: a signal ended it.
    """
    asyncio.run(interrupts.guard(work))
