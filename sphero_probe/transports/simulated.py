"""A pipe to a robot that is a program: it gets what is written, and what it sends is read."""

import asyncio
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from sphero_probe.errors import LinkLostError


class SimulatedRobot(Protocol):
    """A robot without I/O and without a clock; ``now`` is in seconds of any clock.

    Attributes:
        connected: there is a line to it.
        connection: number of the current or last connection.
        on_drop: called when the line drops.
    """

    connected: bool
    connection: int
    on_drop: Callable[[], None]

    def hear(self, data: bytes, *, now: float) -> None:
        """Take what the host wrote."""
        ...

    def speak(self, *, now: float) -> list[bytes]:
        """Return the chunks that have arrived at the host by ``now``, in order."""
        ...

    def next_time(self) -> float | None:
        """Return when ``speak`` may return something, None if it will not without another ``hear``."""
        ...


_Robot = TypeVar("_Robot", bound=SimulatedRobot)


class SimulatedTransport(Generic[_Robot]):
    """A pipe to a simulated robot on the event loop's clock, as long as the connection that it has now."""

    def __init__(self, robot: _Robot) -> None:
        self.robot = robot
        self._connection = robot.connection
        self._woken = asyncio.Event()
        self._ready: list[bytes] = []
        self._closed = False
        self._timer: asyncio.TimerHandle | None = None
        robot.on_drop = self._woken.set

    async def write(self, data: bytes) -> None:
        """Give bytes to the robot.

        Raises:
            LinkLostError: the robot is gone.
        """
        self._listen()
        if not (self._is_ours and self.robot.connected):
            raise LinkLostError("the robot is disconnected")
        self.robot.hear(data, now=asyncio.get_running_loop().time())
        self._watch()

    async def read(self) -> bytes:
        """Wait until the robot sends something and return one chunk of it; ``b""`` once it is gone."""
        while not self._ready:
            self._listen()
            if self._ready:
                break
            if not (self._is_ours and self.robot.connected):
                return b""
            self._woken.clear()
            self._watch()
            await self._woken.wait()
        return self._ready.pop(0)

    def close(self) -> None:
        """End the conversation; a waiting ``read`` returns ``b""``."""
        self._closed = True
        self._woken.set()
        if self._timer:
            self._timer.cancel()

    @property
    def _is_ours(self) -> bool:
        """Whether the robot still talks to this pipe and not to a later one."""
        return not self._closed and self.robot.connection == self._connection

    def _watch(self) -> None:
        """Look when the robot may have something to say, unless the reader is to be woken anyway."""
        if self._ready:
            self._woken.set()
        if self._woken.is_set():
            return
        due = self.robot.next_time()
        if self._timer and (due is None or due < self._timer.when()):
            self._timer.cancel()
            self._timer = None
        if due is not None and not self._timer:
            self._timer = asyncio.get_running_loop().call_at(due, self._look)

    def _look(self) -> None:
        self._timer = None
        self._listen()
        if not (self._is_ours and self.robot.connected):
            self._woken.set()
        self._watch()

    def _listen(self) -> None:
        if self._is_ours:
            self._ready += self.robot.speak(now=asyncio.get_running_loop().time())
