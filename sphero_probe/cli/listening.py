"""What commands that listen to a robot share: reporting, waiting for an end, and switching streams off."""

import asyncio
from collections.abc import Iterable
from contextlib import suppress

from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.switches import taken_back
from sphero_probe.errors import LinkLostError
from sphero_probe.probing.oneshot import send_once
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.registry import Report
from sphero_probe.reports.rows import Row
from sphero_probe.session.session import Session


class CountedReport:
    """Adds rows to a report until there are enough; sets ``stop`` then, or if a row cannot be written."""

    def __init__(self, rows: Report, count: int | None, stop: asyncio.Event) -> None:
        """Take an open report, and how many rows are enough; None for any number."""
        self._rows, self._left, self._stop = rows, count, stop
        self._failure: OSError | None = None

    @property
    def is_full(self) -> bool:
        """Whether no more rows are taken."""
        return self._left == 0 or self._failure is not None

    def add(self, row: Row) -> None:
        """Report a row, unless there are enough."""
        if self.is_full:
            return
        try:
            self._rows.add(row)
        except OSError as error:
            self._failure = error
        else:
            if self._left is not None:
                self._left -= 1
        if self._left == 0 or self._failure:
            self._stop.set()

    def raise_failure(self) -> None:
        """Raise the error that stopped the report.

        Raises:
            OSError: the disk is full, or the reader is gone.
        """
        if self._failure:
            raise self._failure


async def wait_for_end(session: Session, stop: asyncio.Event, seconds: float | None) -> None:
    """Wait until ``stop`` is set, the time is up, or the link is lost.

    Raises:
        LinkLostError: the robot is gone.
    """
    ended = asyncio.create_task(stop.wait())
    gone = asyncio.create_task(session.link.closed())
    try:
        done, _ = await asyncio.wait({ended, gone}, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        if gone in done:
            gone.result()
    finally:
        ended.cancel()
        gone.cancel()
        await asyncio.gather(ended, gone, return_exceptions=True)


async def switch_off(session: Session, executed: Iterable[Command]) -> None:
    """Switch off the streams and notifications that these commands switched on.

    The consent to switch them on covers this. If the link is lost, nothing is raised.
    """
    link = session.link
    commands = taken_back(link.codec.generation, executed)
    with suppress(LinkLostError), link.policy.implying(Risk.WRITE, *commands):
        for command in commands:
            await send_once(link, command)
