"""When a robot sleeps and wakes by itself: times and touches come in, what happens when goes out."""

from enum import Enum
from typing import NamedTuple


class SleepEvent(Enum):
    """What a robot does by itself as time goes by."""

    WARN = "it will sleep soon"
    SLEEP = "it falls asleep"
    WAKE = "it wakes up"
    BOOT = "it has started anew"


class _Event(NamedTuple):
    at: float
    turn: SleepEvent


class SleepTimer:
    """The timers of one robot; all times in seconds of the caller's clock."""

    def __init__(self, timeout: float | None, notice: float) -> None:
        """Take the seconds without a touch until it sleeps, None for never, and how long before it warns."""
        self._timeout = timeout
        self._notice = notice
        self._begun = False
        self._coming: list[_Event] = []

    def begin(self, *, now: float) -> None:
        """Start the timers if they do not run yet: nobody knew the time before."""
        if not self._begun:
            self.touch(now=now)

    def touch(self, *, now: float) -> None:
        """Somebody used the robot: it sleeps a whole timeout from now, and warns if there is time to."""
        self._begun = True
        self._coming = []
        if self._timeout is not None:
            sleeps = now + self._timeout
            if self._timeout > self._notice:
                self._coming.append(_Event(sleeps - self._notice, SleepEvent.WARN))
            self._coming.append(_Event(sleeps, SleepEvent.SLEEP))

    def set_timeout(self, timeout: float) -> None:
        """Sleep after another number of seconds, from the next touch on."""
        self._timeout = timeout

    def sleep(self, wakes: float | None = None) -> None:
        """It sleeps: nothing comes any more, or that it wakes at some time."""
        self._begun = True
        self._coming = [] if wakes is None else [_Event(wakes, SleepEvent.WAKE)]

    def boot(self, done: float) -> None:
        """It starts anew: nothing comes before it is done."""
        self._begun = True
        self._coming = [_Event(done, SleepEvent.BOOT)]

    @property
    def due(self) -> float | None:
        """When something happens next."""
        return self._coming[0].at if self._coming else None

    def take(self) -> SleepEvent:
        """Return what happens next, and wait for what comes after it."""
        return self._coming.pop(0).turn
