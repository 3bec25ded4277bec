"""The queue of commands that wait to be served; commands that find it full are rejected."""

from collections import deque
from typing import Final

from sphero_probe.protocol.packets import Request

SERVICE: Final = 0.001
"""Seconds that a robot with a queue takes for one command, unless they are set.

An assumption: fast enough for six commands in each BLE connection event of 15 ms, too slow for any burst.
"""


class CommandQueue:
    """Serves one command after the other; a command that finds no place to wait is rejected.

    All times are in seconds of the caller's clock.
    """

    def __init__(self, places: int | None, service: float | None = None) -> None:
        """Take how many commands can wait besides the one that is served, and how long serving one takes.

        Without either, no command waits. Without places all have room; without a time it is ``SERVICE``.
        """
        self._places = places
        self._service = SERVICE if service is None and places is not None else service
        self._line: deque[tuple[float, Request]] = deque()

    def admit(self, request: Request, *, now: float) -> bool:
        """Let a command wait; commands served by ``now`` must have been taken before.

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
        """Drop the commands that wait."""
        self._line.clear()
