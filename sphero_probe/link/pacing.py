"""How fast one node may be asked: what is sent and how it ends come in, timeout and window come out. Pure."""

from typing import Final

FIRST_TIMEOUT: Final = 1.0
"""Seconds, as long as no answer was timed; and at least, for a command that does something."""
SHORTEST_TIMEOUT: Final = 0.1
LONGEST_BACKOFF: Final = 3.0
"""Seconds that silence alone may make the timeout."""
LONGEST_TIMEOUT: Final = 10.0
"""Seconds that slow answers may make the timeout."""
LATE_MARGIN: Final = 1.25
"""Factor on the time that a late answer took."""
GRAIN: Final = 0.05
"""Seconds that the timeout is above the smoothed round trip at least (``G`` of RFC 6298)."""
GRACE: Final = 0.01
"""Seconds at least for which an overtaken command is waited for."""
SHORTEST_LAST_TRY: Final = 0.25
"""Seconds at least for a command that is waited for longest: it may be slower than an echo."""
BACKOFF: Final = 1.5
"""Factor on the timeout after a silence, until an answer is timed again."""
MAX_ATTEMPTS: Final = 3
"""How often a command that should be answered is sent."""
SLOW_START: Final = 4
"""Up to here the window grows by one with each answer, beyond it by one with each window of answers."""
WIDEST: Final = 12
"""Commands in flight at most: what two connection events of a fast BLE link carry either way."""

_SMOOTHING, _VARIATION = 1 / 8, 1 / 4


class Pace:
    """The pace of one node; ``now`` is any clock in seconds that does not run backwards.

    A robot serves its commands in order. So whatever was sent before an answered command was served, too: it
    takes no place in the window any more, though its own answer may still come.

    Attributes:
        timeout: seconds until a command counts as silent: the smoothed round trip and four variations of it
            [RFC 6298], but at least two round trips, as a window that opens makes them longer.
        round_trip: smoothed, in seconds; None until an answer was timed.
    """

    def __init__(self, timeout: float | None = None, window: int | None = None) -> None:
        """Take a timeout and a window that never change, None for those that adapt."""
        self.timeout = FIRST_TIMEOUT if timeout is None else timeout
        self.round_trip: float | None = None
        self._fixed_timeout = timeout is not None
        self._fixed_window = window
        self._variation = 0.0
        self._window = 1.0
        self._threshold: float = SLOW_START
        self._narrowed_at = self._slowed_at = self._full_at = float("-inf")
        self._sent: dict[int, float] = {}

    @property
    def window(self) -> int:
        """How many commands may be in flight."""
        return self._fixed_window or int(self._window)

    @property
    def in_flight(self) -> int:
        """How many commands the node's queue may still hold."""
        return len(self._sent)

    def sent(self, seq: int, *, now: float) -> None:
        """Take in that a command goes out."""
        self._sent[seq] = now
        if self.in_flight >= self.window:
            self._full_at = now

    @property
    def last_try_timeout(self) -> float:
        """Seconds for a command that no answer to a later one cuts short."""
        return self.timeout if self._fixed_timeout else max(SHORTEST_LAST_TRY, self.timeout)

    @property
    def grace(self) -> float:
        """Seconds for which an overtaken command is waited for."""
        return max(GRACE, 4 * self._variation)

    def answered(self, seq: int, round_trip: float, *, now: float, busy: bool = False) -> list[int]:
        """Take in an answer; return the numbers of the commands that it overtook.

        Args:
            seq: the command's number.
            round_trip: seconds since it was sent; each attempt has a number of its own, so it is true.
            now: the time.
            busy: the node says that it is asked too much.
        """
        sent = self._sent.get(seq, now - round_trip)
        if busy:  # refused at the door: it overtook nothing, and its round trip says nothing of served ones
            self.forget(seq)
            self._narrow(sent, now)
            return []
        self._time(round_trip)
        if sent <= self._full_at:  # a window that was not filled proves nothing
            grown = 1.0 if self._window < self._threshold else 1 / self._window
            self._window = min(WIDEST, self._window + grown)
        overtaken: list[int] = []
        if seq in self._sent:
            in_order = list(self._sent)
            overtaken = in_order[: in_order.index(seq)]
            for served in (*overtaken, seq):
                del self._sent[served]
        return overtaken

    def silent(self, seq: int, waited: float, *, now: float, expected: bool = False) -> None:
        """Take in that no answer came in time.

        Args:
            seq: the command's number.
            waited: seconds since it was sent.
            now: the time.
            expected: an answer was sure to come, so too much was asked at a time.
        """
        sent = self._sent.get(seq, now - waited)
        if seq in self._sent and sent >= self._slowed_at and not self._fixed_timeout:
            self.timeout = max(self.timeout, min(LONGEST_BACKOFF, self.timeout * BACKOFF))
            self._slowed_at = now
        self.forget(seq)
        if expected:
            self._narrow(sent, now)

    def answered_late(self, took: float) -> None:
        """Take in that an answer came after its command counted as silent: be more patient from now on.

        Args:
            took: seconds since the command was sent.
        """
        if not self._fixed_timeout:
            self.timeout = max(self.timeout, min(LONGEST_TIMEOUT, LATE_MARGIN * took))

    def forget(self, seq: int) -> None:
        """Take in that nobody waits for a command any more."""
        self._sent.pop(seq, None)

    def _narrow(self, sent: float, now: float) -> None:
        """Halve the window, once for all that was sent before it took effect."""
        if sent >= self._narrowed_at:
            self._window = self._threshold = max(1.0, self._window / 2)
            self._narrowed_at = now

    def _time(self, round_trip: float) -> None:
        if self.round_trip is None:
            self.round_trip, self._variation = round_trip, round_trip / 2
        else:
            error = round_trip - self.round_trip
            self._variation += _VARIATION * (abs(error) - self._variation)
            self.round_trip += _SMOOTHING * error
        if not self._fixed_timeout:
            timeout = self.round_trip + max(GRAIN, self.round_trip, 4 * self._variation)
            self.timeout = min(max(timeout, SHORTEST_TIMEOUT), LONGEST_TIMEOUT)
