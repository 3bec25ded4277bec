"""The line to one robot over its drops: what dropped it in, the same robot at the other end again out."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, Final

from sphero_probe.errors import ConnectionFailedError, LinkLostError, SpheroProbeError
from sphero_probe.link.link import Link
from sphero_probe.probing.asking import Asker

REOPENINGS: Final = 50
"""How often a run opens a dropped line again; a probe that drops it is asked twice at most."""
PAUSES: Final = (0.0, 0.25, 0.5, 1.0, 2.0)
"""Seconds to wait for a robot that is not itself; a reboot takes about two."""

Reopen = Callable[[], Awaitable[Link]]
"""Opens the line to the same robot again; fails as connecting does."""


class Line:
    """Opens a dropped line again, and makes sure that the same robot answers.

    Attributes:
        lost: why the line is gone for good, None while it stands.
        frames: command frames sent over links that are closed by now.
        reopened: how often the line was opened again.
    """

    def __init__(self, asker: Asker, stop: asyncio.Event, reopen: Reopen | None = None) -> None:
        self.lost: LinkLostError | None = None
        self.frames = 0
        self.reopened = 0
        self._asker = asker
        self._stop = stop
        self._reopen = reopen
        self._firmware: dict[str, str] | None = None

    def know(self, firmware: dict[str, str]) -> None:
        """Take in the firmware that a line opened again must lead to."""
        self._firmware = firmware

    async def steady(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Do what asks the robot, again when the line drops under it; ``lost`` tells when it was in vain.

        Whoever stops the run stops it, too, wherever it is.
        """
        while not (self.lost or self._stop.is_set()):
            try:
                await self._until_stopped(work)
            except LinkLostError as error:
                await self.open_again(error)
            else:
                return

    async def _until_stopped(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        working, stopped = asyncio.create_task(work()), asyncio.create_task(self._stop.wait())
        try:
            await asyncio.wait({working, stopped}, return_when=asyncio.FIRST_COMPLETED)
            if working.done():
                working.result()
        finally:
            working.cancel()
            stopped.cancel()
            await asyncio.gather(working, stopped, return_exceptions=True)

    async def open_again(self, error: LinkLostError) -> None:
        """Open the line to the same robot again, or take in that it is gone."""
        failures = 0
        while not self.lost:
            if self._reopen is None or self.reopened >= REOPENINGS or self._stop.is_set():
                self.lost = error
                return
            self.reopened += 1
            old = self._asker.link
            self.frames += old.frames_sent
            try:
                self._asker.link = await self._reopen()
                self._asker.link.on_aside = old.on_aside
                await self._check_same_robot()
            except LinkLostError as again:
                error = again
            except ConnectionFailedError as again:
                failures += 1
                error = LinkLostError(f"the robot did not come back: {again}", again.hint)
                if failures == len(PAUSES):
                    self.lost = error
            except SpheroProbeError as again:
                self.lost = LinkLostError(f"the robot did not come back: {again}", again.hint)
            else:
                return
            await asyncio.sleep(PAUSES[failures % len(PAUSES)])

    async def _check_same_robot(self) -> None:
        """Compare the firmware; a robot that says nothing yet may be booting, and gets some time.

        Raises:
            LinkLostError: the line dropped again; ``lost`` is set where another firmware answers.
        """
        expected = self._firmware or {}
        for pause in PAUSES:
            await asyncio.sleep(pause)
            await self._asker.wake()
            firmware = await self._asker.firmware()
            if any(expected.get(node, version) != version for node, version in firmware.items()):
                self.lost = LinkLostError("another firmware answers after the link dropped")
                return
            if firmware.keys() >= expected.keys():
                return
