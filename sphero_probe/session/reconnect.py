"""Reconnect after a dropped link, and check that the same robot answers."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from typing import Any, Final

from sphero_probe.errors import ConnectionFailedError, LinkLostError, SpheroProbeError
from sphero_probe.link.link import Link
from sphero_probe.session.identify import read_firmware, wake
from sphero_probe.session.identity import firmware_difference

MAX_RECONNECTS: Final = 50
"""How often a run reconnects; a probe that drops the link is sent twice at most."""
PAUSES: Final = (0.0, 0.25, 0.5, 1.0, 2.0)
"""Seconds to wait before each attempt to reach a robot that is not ready; a reboot takes about two."""

Reconnect = Callable[[], Awaitable[Link]]
"""Connects to the same robot again; raises what connecting raises."""


class Reconnector:
    """The link to one robot; it reconnects after drops as long as the same robot answers.

    Attributes:
        link: the open link; another one after a reconnect.
        lost: why the link is lost for good, None while it is not.
        reconnects: how often it reconnected.
    """

    def __init__(
        self,
        link: Link,
        target: int | None,
        stop: asyncio.Event | None = None,
        reconnect: Reconnect | None = None,
    ) -> None:
        """Keep an open link.

        Args:
            link: to the robot.
            target: the address byte of the robot's usual node.
            stop: once set, it does not reconnect any more.
            reconnect: connects to the same robot again; None never reconnects.
        """
        self.link = link
        self.lost: LinkLostError | None = None
        self.reconnects = 0
        self._frames = -link.frames_sent
        self._target = target
        self._stop = stop or asyncio.Event()
        self._reconnect = reconnect
        self._firmware: dict[str, str] = {}

    @property
    def frames_sent(self) -> int:
        """How many command frames were sent, over all links."""
        return self._frames + self.link.frames_sent

    @property
    def is_stopped(self) -> bool:
        """Whether the run was told to end."""
        return self._stop.is_set()

    async def pause(self, seconds: float) -> None:
        """Sleep, but no longer than until the run is told to end."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._stop.wait(), seconds)

    def expect_firmware(self, firmware: dict[str, str]) -> None:
        """Set the firmware that the robot must have after a reconnect."""
        self._firmware = firmware

    async def with_reconnect(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run work that asks the robot; run it again after each drop, until it is done or ``lost`` is set.

        Setting ``stop`` cancels the work at once.
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
        """Reconnect to the same robot; set ``lost`` if that fails.

        Args:
            error: what dropped it.
        """
        failures = 0
        while not self.lost:
            if self._reconnect is None or self.reconnects >= MAX_RECONNECTS or self._stop.is_set():
                self.lost = error
                return
            self.reconnects += 1
            try:
                await self._until_stopped(self._open_once)
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
                if self.is_stopped:
                    self.lost = self.lost or error
                return
            await self.pause(PAUSES[failures % len(PAUSES)])

    async def _open_once(self) -> None:
        if self._reconnect is None:
            return
        old = self.link
        self.link = await self._reconnect()
        self._frames += old.frames_sent
        self.link.tolerated.update(old.tolerated)
        self.link.events = old.events  # the listeners hear the new link
        await self._check_same_robot()

    async def _check_same_robot(self) -> None:
        """Compare the firmware; a robot that does not answer yet may be booting and gets some time.

        Raises:
            LinkLostError: the link dropped again; ``lost`` is set if another firmware answers.
        """
        for pause in PAUSES:
            await asyncio.sleep(pause)
            await wake(self.link, self._target)
            firmware = await read_firmware(self.link, self._target)
            if changed := firmware_difference(self._firmware, firmware):
                self.lost = LinkLostError(f"another firmware answers after the link dropped: {changed}")
                return
            if firmware.keys() >= self._firmware.keys():
                return
