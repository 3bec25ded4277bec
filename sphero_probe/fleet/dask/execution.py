"""One execution of a task on a worker: what it tells the client, and what it waits for."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from sphero_probe.errors import IncompleteError
from sphero_probe.fleet.dask.messages import Begin, Downward, Grown, Hello, Leave, Stop, Upward, Written
from sphero_probe.fleet.records import FleetRecord

_DELAY: Final = 0.02
"""Seconds for which news may be collected, so that a run needs few messages."""
_AHEAD: Final = 1 << 20
"""Bytes of journal that may be on their way to the client; then the run waits."""
_PERMISSION: Final = 60.0
"""Seconds to wait for the client's permission to begin; a client that is there answers at once."""
_AGAIN: Final = 1.0
"""Seconds until the client is asked for it again."""
GRACE: Final = 5.0
"""Seconds that a run has to end cleanly, if its client is gone or its worker ends."""
_GONE: Final = "the program that asked for this run is gone"


class Execution:
    """Collects what happens on one robot, and sends it to the client in few messages.

    Attributes:
        stop: set when the run must end once nothing is in flight.
        leaving: the worker ends, and another one is to go on.
        limit: ends the work in this block if there is no permission to begin, or the client is gone.
    """

    def __init__(self, hello: Hello, tell: Callable[[Upward], None], *, at_once: bool) -> None:
        """Collect for one execution.

        Args:
            hello: what to introduce it with.
            tell: sends a message to the client.
            at_once: send each line as it is made, because a lost answer could not be asked for again.
        """
        self.stop = asyncio.Event()
        self.leaving = False
        self.limit = asyncio.timeout(_PERMISSION)
        self._hello, self._tell = hello, tell
        self._begin: Begin | None = None
        self._delay = 0.0 if at_once else _DELAY
        self._lines = bytearray()
        self._records: list[FleetRecord] = []
        self._timer: asyncio.TimerHandle | None = None
        self._sent = self._ahead = 0
        self._written = 0
        self._changed = asyncio.Event()
        self._gone = False

    async def permission(self) -> Begin | None:
        """Ask the client until it lets the run begin; return None if the worker ends before."""
        while self._begin is None and not self.leaving:
            self._tell(self._hello)
            self._changed.clear()
            with suppress(TimeoutError):
                async with asyncio.timeout(_AGAIN):
                    await self._changed.wait()
        self.limit.reschedule(None)
        return self._begin

    def add_line(self, line: bytes) -> None:
        """Collect a line of the journal."""
        self._lines += line
        self._flush_soon()

    def add_record(self, record: FleetRecord) -> None:
        """Collect a record."""
        self._records.append(record)
        self._flush_soon()

    def flush(self, *, awaited: bool = False) -> None:
        """Send what was collected.

        Args:
            awaited: ask for ``Written``.
        """
        if self._timer:
            self._timer.cancel()
            self._timer = None
        if not (self._lines or self._records or awaited):
            return
        self._sent += 1
        self._ahead += len(self._lines)
        self._tell(
            Grown(
                self._hello.device,
                self._hello.execution,
                self._sent,
                bytes(self._lines),
                tuple(self._records),
                awaited,
            )
        )
        self._lines.clear()
        self._records.clear()

    async def room(self) -> None:
        """Wait while the client is too far behind.

        Raises:
            IncompleteError: the client is gone.
        """
        if self._ahead > _AHEAD:
            await self.written()

    async def written(self) -> None:
        """Wait until all lines so far are in the client's journal.

        Raises:
            IncompleteError: the client is gone.
        """
        self.flush(awaited=True)
        number = self._sent
        while self._written < number:
            if self._gone:
                raise IncompleteError(_GONE)
            self._changed.clear()
            await self._changed.wait()
        if number == self._sent:
            self._ahead = 0

    def hear(self, message: Downward) -> None:
        """Take what the client says."""
        match message:
            case Begin():
                self._begin = message
            case Written(number=number):
                self._written = max(self._written, number)
            case Stop():
                self.stop.set()
            case Leave():
                self.end()
        self._changed.set()

    def leave(self) -> None:
        """End the run, because the worker ends."""
        self.leaving = True
        self.stop.set()
        self._changed.set()

    def end(self) -> None:
        """End the run, because the client is gone; nothing that waits for the client is sent."""
        self._gone = True
        self.stop.set()
        self._changed.set()
        self.limit.reschedule(asyncio.get_running_loop().time() + (GRACE if self._begin else 0))

    def _flush_soon(self) -> None:
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(self._delay, self.flush)
