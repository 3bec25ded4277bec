"""The line between host and robot: packets go in as sent, and come out late, cut up, damaged, or never."""

from collections import deque
from random import Random
from typing import Final

from sphero_probe.simulator.settings import Settings

NOTIFICATION_BYTES: Final = 20
"""What one BLE notification carries at the smallest MTU, 23 bytes less 3 of its own."""


class Radio:
    """A line with faults that depend on the seed alone; what gets through stays in order.

    Faults hit whole packets, one write of the host or one frame of the robot, before a frame is cut up: how
    many survive does not depend on ``split``.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._size = settings.split or NOTIFICATION_BYTES
        self._up = Random(f"{settings.seed} up")
        self._down = Random(f"{settings.seed} down")
        self._air: deque[tuple[float, bytes]] = deque()

    def carry(self, data: bytes) -> bytes:
        """Return what the robot receives of one write; nothing when it is lost."""
        return self._spoil(data, self._up)

    def send(self, frame: bytes, *, now: float) -> None:
        """Let a frame of the robot set out; ``now`` in seconds of the caller's clock."""
        copies = 2 if self._settings.duplicate and self._down.random() < self._settings.duplicate else 1
        for _ in range(copies):
            arrives = now + self._settings.latency
            if self._air:
                arrives = max(arrives, self._air[-1][0])
            data = self._spoil(frame, self._down)
            self._air.extend((arrives, data[at : at + self._size]) for at in range(0, len(data), self._size))

    def receive(self, *, now: float) -> list[bytes]:
        """Return the notifications that have arrived by ``now``, in order."""
        arrived = []
        while self._air and self._air[0][0] <= now:
            arrived.append(self._air.popleft()[1])
        return arrived

    def next_time(self) -> float | None:
        """Return when the next notification arrives, None while nothing is under way."""
        return self._air[0][0] if self._air else None

    def _spoil(self, data: bytes, chance: Random) -> bytes:
        """Lose a packet, or change one byte of it."""
        if self._settings.loss and chance.random() < self._settings.loss:
            return b""
        if data and self._settings.corrupt and chance.random() < self._settings.corrupt:
            at = chance.randrange(len(data))
            return data[:at] + bytes((data[at] ^ chance.randrange(1, 0x100),)) + data[at + 1 :]
        return data
