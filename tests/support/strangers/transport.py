"""The transport to a stranger, on the event loop's clock."""

import asyncio
from typing import Final

from sphero_probe.errors import LinkLostError
from tests.support.strangers.frames import notification_v1, notification_v2
from tests.support.strangers.robot import Robot

MAX_WRITES: Final = 20_000
"""Writes to one robot, over all its lines: a run that needs more does not end."""
_BURST: Final = 0.02
"""Seconds between two bursts of notifications."""


_BETWEEN: Final = 1e-5
"""Seconds between two pieces of one answer: timers of the same moment fire in any order."""


class TooManyWritesError(Exception):
    """A run that does not end was ended."""


class StrangerTransport:
    """One line to a robot, until the robot drops it or it is closed."""

    def __init__(self, robot: Robot, writes: int = 0) -> None:
        """Open a line; ``writes`` went to the robot over earlier ones."""
        self.robot = robot
        self.writes = writes
        self._loop = asyncio.get_running_loop()
        self._coming: asyncio.Queue[bytes] = asyncio.Queue()
        self._timers: set[asyncio.TimerHandle] = set()
        self._next_burst: asyncio.TimerHandle | None = None
        self._gone = False
        robot.connect(self._loop.time())
        if robot.voice.flood:
            self._flood()

    async def write(self, data: bytes) -> None:
        """Pass bytes to the robot.

        Raises:
            LinkLostError: the robot dropped the line.
            TooManyWritesError: the run does not end.
        """
        self.writes += 1
        if self.writes > MAX_WRITES:
            raise TooManyWritesError(f"{MAX_WRITES} writes to one small robot")
        if self._gone:
            raise LinkLostError("the stranger is gone")
        for place, said in enumerate(self.robot.hear(data, self._loop.time())):
            self._later(said.delay + place * _BETWEEN, said.data)
        if self.robot.dropped:
            self.close()

    async def read(self) -> bytes:
        """Wait for bytes from the robot; ``b""`` once it dropped the line."""
        if self._gone and self._coming.empty():
            return b""
        return await self._coming.get()

    def close(self) -> None:
        """Close the line; a waiting ``read`` returns ``b""``."""
        self._gone = True
        for timer in (*self._timers, self._next_burst):
            if timer:
                timer.cancel()
        self._timers.clear()
        self._coming.put_nowait(b"")

    def _later(self, delay: float, data: bytes) -> None:
        def arrive() -> None:
            self._timers.discard(timer)
            self._coming.put_nowait(data)

        timer = self._loop.call_later(delay, arrive)
        self._timers.add(timer)

    def _flood(self) -> None:
        """Send notifications all the time."""
        if self._gone:
            return
        older = self.robot.firmware.older
        one = notification_v1(0x03, bytes(8)) if older else notification_v2(0x18, 0x02, bytes(12))
        self._coming.put_nowait(one * round(self.robot.voice.flood * _BURST))
        self._next_burst = self._loop.call_later(_BURST, self._flood)
