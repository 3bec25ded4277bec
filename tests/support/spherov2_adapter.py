"""Connects spherov2's toy classes to a fake robot, through spherov2's adapter interface."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent import futures
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import spherov2.toy
from spherov2.toy import Toy

from sphero_probe.catalogue.gatt import PROFILES, V1_WAKE, V1_WAKE_CHARACTERISTIC
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Role
from sphero_probe.simulator import FakeRobot

_PATIENCE = 10.0
"""Real seconds after which a thread counts as stuck; a good run never waits that long."""
_FORESIGHT = 60.0
"""Most virtual seconds that pass by themselves after a write; V1 robots fall asleep after 600."""


class FakeAdapter:
    """spherov2's adapter: ``write``, ``set_callback`` and ``close``; the clock jumps to what happens next.

    The toy writes from its own thread. Everything else runs in the thread that waits for an answer: an answer
    therefore never arrives before a thread waits for it; spherov2 would lose it.

    Attributes:
        robot: the connected robot; ``address`` takes the place of a scan result.
        now: virtual time in seconds.
        greetings: (characteristic, data) of every write to a characteristic other than the API.
        heard: the pieces of data that the toy received.
        closed: ``close`` was called.
    """

    def __init__(self, robot: FakeRobot, address: str) -> None:
        if address != robot.address:
            raise LookupError(f"no robot at {address}")
        self.robot = robot
        self.now = 0.0
        self.greetings: list[tuple[str, bytes]] = []
        self.heard: list[bytes] = []
        self.closed = False
        (self._profile,) = [one for one in PROFILES if one.generation is robot.model.generation]
        self._decoder = CODECS[robot.model.generation].decoder(Role.ROBOT)
        self._until = _FORESIGHT
        self._callbacks: dict[str, Callable[[str, bytearray], None]] = {}
        self._written: SimpleQueue[bytes] = SimpleQueue()
        self._arrived: deque[bytes] = deque()
        self._frames = 0

    def write(self, uuid: str, data: bytes) -> None:
        """Receive one write of the toy, from any thread; a write that wakes a V1 robot, from the waiting one.

        Raises:
            LookupError: the robot has no such characteristic.
        """
        if uuid == self._profile.commands:
            self._written.put(bytes(data))
        elif uuid not in dict(self._profile.unlock):
            raise LookupError(f"{self.robot.name} has no characteristic {uuid}")
        else:
            self.greetings.append((uuid, bytes(data)))
            if self.greetings[-1] == (V1_WAKE_CHARACTERISTIC, V1_WAKE):
                self.robot.wake(now=self.now)

    def set_callback(self, uuid: str, callback: Callable[[str, bytearray], None]) -> None:
        """Deliver the notifications of a characteristic from now on."""
        self._callbacks[uuid] = callback

    def close(self) -> None:
        """Disconnect."""
        self.closed = True

    def run_until(self, done: Callable[[], bool], timeout: float | None) -> None:
        """Run both sides until a condition holds, or the robot has received a command and stays silent.

        The toy has ``timeout`` seconds of the real clock to write.
        """
        before = self._frames
        while not done():
            if self._advance():
                continue
            if self._frames > before:
                return
            try:
                self._hear(self._written.get(timeout=timeout))
            except Empty:
                return

    def settle(self) -> None:
        """Deliver everything that is in flight."""
        while self._advance():
            pass

    def idle(self, seconds: float) -> None:
        """Let time pass, and deliver everything that is due."""
        self._until = self.now + seconds
        self.settle()
        self.now = self._until

    def _advance(self) -> bool:
        """Do the next step that need not wait for the toy; return False if there is none."""
        if not self._written.empty():
            self._hear(self._written.get())
        elif self._arrived:
            self.heard.append(self._arrived.popleft())
            self._callbacks[self._profile.answers](self._profile.answers, bytearray(self.heard[-1]))
        elif chunks := self.robot.speak(now=self.now):
            self._arrived.extend(chunks)
        elif (due := self.robot.next_time()) is not None and due <= self._until:
            self.now = max(self.now, due)
        else:
            return False
        return True

    def _hear(self, data: bytes) -> None:
        """Pass a write to the robot.

        Raises:
            ConnectionError: the robot wants a handshake first.
        """
        if self.robot.model.handshake and self._profile.unlock[0] not in self.greetings:
            raise ConnectionError(f"{self.robot.name} has not been greeted")
        self.robot.hear(data, now=self.now)
        self._until = self.now + _FORESIGHT
        self._frames += len(self._decoder.feed(data))


@contextmanager
def session(toy_class: type[Toy], robot: FakeRobot) -> Iterator[tuple[Any, FakeAdapter]]:
    """Open one of spherov2's robots over a fake one, without its pauses between commands.

    Yields:
        The toy and its adapter. After the block the adapter is closed and every thread has ended.
    """
    adapters: list[FakeAdapter] = []

    def connect(address: str) -> FakeAdapter:
        adapters.append(FakeAdapter(robot, address))
        return adapters[-1]

    class Future(futures.Future[Any]):
        """An event that a toy waits for; waiting makes the fake robot's time pass."""

        def result(self, timeout: float | None = None) -> Any:
            adapters[-1].run_until(self.done, timeout)
            return super().result(timeout=0)

    before = set(threading.enumerate())
    with (
        patch.object(toy_class, "toy_type", toy_class.toy_type._replace(cmd_safe_interval=0)),
        patch.object(spherov2.toy, "futures", SimpleNamespace(Future=Future)),
        toy_class(robot, connect) as toy,
    ):
        yield toy, adapters[-1]
    while left := set(threading.enumerate()) - before:  # a listener's thread may start another one
        for thread in left:
            if thread.is_alive():  # else it is about to start: join would refuse
                thread.join(_PATIENCE)
                if thread.is_alive():
                    raise RuntimeError(f"spherov2 left {thread} behind")
    if not adapters[-1].closed:
        raise RuntimeError("spherov2 left its adapter open")
