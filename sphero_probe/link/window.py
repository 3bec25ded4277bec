"""How many commands may be in flight, in all and to each node."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import inf

from sphero_probe.link.alarm import TICK
from sphero_probe.link.pacing import WIDEST, Pace
from sphero_probe.link.requests import QueuedCommand


class Window:
    """Gives queued commands their places in flight.

    Attributes:
        limit: the most commands in flight to a node, whatever its pace allows.
    """

    def __init__(self, timeout: float | None, size: int | None) -> None:
        """Take what was fixed.

        Args:
            timeout: seconds until a command counts as silent; None measures it, node by node.
            size: commands in flight; None adapts it, node by node, to what the robot takes.
        """
        self.limit = size or WIDEST
        self._timeout = timeout
        self._size = size
        self._paces: dict[int | None, Pace] = {}
        self._taken = 0
        self._exclusive = False
        self._fixed: int | None = None

    @contextmanager
    def fixed(self, size: int) -> Iterator[None]:
        """Let exactly so many commands be in flight to each node while the block lasts, whatever its pace."""
        self._fixed = size
        try:
            yield
        finally:
            self._fixed = None

    def pace(self, target: int | None) -> Pace:
        """Return the pace of the node at an address."""
        pace = self._paces.get(target)
        if pace is None:
            pace = self._paces[target] = Pace(self._timeout, self._size)
        return pace

    def room(self, target: int | None) -> int:
        """Return how many more commands could be sent to a node right now."""
        if self._exclusive:
            return 0
        pace = self.pace(target)
        size = self._fixed or min(self.limit, pace.window)
        return max(0, size - pace.in_flight)

    def has_place(self, queued: QueuedCommand) -> bool:
        """Whether a command may be sent now; one to be sent alone waits until nothing is in flight."""
        return self._taken == 0 if queued.alone else self.room(queued.command.target) > 0

    def ready_at(self, queued: QueuedCommand) -> float:
        """Return when its node is ready for a command that has a place."""
        return -inf if queued.alone or self._fixed else self.pace(queued.command.target).ready_at - TICK

    def take(self, queued: QueuedCommand) -> None:
        """Give a command its place."""
        self._taken += 1
        self._exclusive = queued.alone

    def free(self, queued: QueuedCommand) -> None:
        """Free the place of a command that has ended."""
        self._taken -= 1
        if queued.alone:
            self._exclusive = False
