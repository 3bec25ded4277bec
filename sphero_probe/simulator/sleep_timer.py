"""When a robot sleeps and wakes by itself, from its timers and the activity of its client."""

from enum import Enum
from typing import NamedTuple


class SleepEvent(Enum):
    """What a robot does by itself after a time."""

    WARN = "it will sleep soon"
    SLEEP = "it falls asleep"
    WAKE = "it wakes up"
    BOOT = "it has restarted"


class _Event(NamedTuple):
    at: float
    kind: SleepEvent


class SleepTimer:
    """The timers of one robot; all times in seconds of the caller's clock."""

    def __init__(self, timeout: float | None, notice: float) -> None:
        """Take the seconds without activity until it sleeps, None for never, and how long before it warns."""
        self._timeout = timeout
        self._notice = notice
        self._begun = False
        self._events: list[_Event] = []

    def begin(self, *, now: float) -> None:
        """Start the timers if they do not run yet; the time was unknown before."""
        if not self._begun:
            self.touch(now=now)

    def touch(self, *, now: float) -> None:
        """Restart the timeout because the robot was used; it warns before it sleeps if there is time to."""
        self._begun = True
        self._events = []
        if self._timeout is not None:
            sleeps = now + self._timeout
            if self._timeout > self._notice:
                self._events.append(_Event(sleeps - self._notice, SleepEvent.WARN))
            self._events.append(_Event(sleeps, SleepEvent.SLEEP))

    def set_timeout(self, timeout: float) -> None:
        """Sleep after another number of seconds, from the next activity on."""
        self._timeout = timeout

    def sleep(self, wakes: float | None = None) -> None:
        """Sleep: the only event left is to wake, if it wakes at some time."""
        self._begun = True
        self._events = [] if wakes is None else [_Event(wakes, SleepEvent.WAKE)]

    def boot(self, done: float) -> None:
        """Restart: no event comes before that is done."""
        self._begun = True
        self._events = [_Event(done, SleepEvent.BOOT)]

    @property
    def due(self) -> float | None:
        """When the next event is due, None if there is none."""
        return self._events[0].at if self._events else None

    def take(self) -> SleepEvent:
        """Return the next event, and remove it."""
        return self._events.pop(0).kind
