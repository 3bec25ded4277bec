"""Where commands wait: requests and their times go in, the same come out once served, or are turned away."""

from collections import deque
from typing import Final

from sphero_probe.protocol.packets import Request

SERVICE: Final = 0.001
"""Seconds that a robot with a queue takes for one command, unless it is told otherwise.

An assumption: fast enough for six commands in each BLE connection event of 15 ms, too slow for any burst.
"""


class CommandQueue:
    """Serves one command after the other; who finds no place to wait is turned away.

    All times are in seconds of the caller's clock.
    """

    def __init__(self, places: int | None, service: float | None = None) -> None:
        """Take how many commands can wait beside the one that is served, and how long serving one takes.

        Without either nobody ever waits. Without places there is room for all, without a time it is usual.
        """
        self._places = places
        self._service = SERVICE if service is None and places is not None else service
        self._line: deque[tuple[float, Request]] = deque()

    def admit(self, request: Request, *, now: float) -> bool:
        """Let a command wait; whoever was done by ``now`` must have been taken away before.

        Returns:
            Whether there was a place for it.
        """
        if self._service is None:
            self._line.append((now, request))
        elif self._places is None or len(self._line) <= self._places:
            begins = self._line[-1][0] if self._line else now
            self._line.append((begins + self._service, request))
        else:
            return False
        return True

    @property
    def due(self) -> float | None:
        """When the next command has been served, None while there is none."""
        return self._line[0][0] if self._line else None

    def take(self) -> Request:
        """Return the next command; there must be one."""
        return self._line.popleft()[1]

    def clear(self) -> None:
        """Forget who waits."""
        self._line.clear()
