"""Adapt the timeout and the window of one node to how it answers. It does no I/O; the caller passes times."""

from math import inf
from typing import Final

from sphero_probe.link.overflow import Crowd, Overflow

FIRST_TIMEOUT: Final = 1.0
"""Seconds until an answer was timed; also the minimum for a command that acts."""
SHORTEST_TIMEOUT: Final = 0.1
LONGEST_BACKOFF: Final = 3.0
"""Seconds up to which silence alone raises the timeout."""
LONGEST_TIMEOUT: Final = 10.0
"""Seconds up to which slow answers raise the timeout."""
LATE_MARGIN: Final = 1.25
"""Factor on the time that a late answer took."""
GRAIN: Final = 0.05
"""Seconds by which the timeout exceeds the smoothed round trip at least (``G`` of RFC 6298)."""
GRACE: Final = 0.01
"""Minimum seconds to wait for an overtaken command."""
PATIENT_ROUND_TRIPS: Final = 4
"""Round trips from its first attempt on in which no command is called silent: it may be slow."""
SHORTEST_PATIENCE: Final = 0.1
"""Minimum seconds of that."""
BACKOFF: Final = 1.5
"""Factor by which each silence raises the timeout, until an answer is timed again."""
MAX_ATTEMPTS: Final = 3
"""How often a command that should be answered is sent."""
SLOW_START: Final = 12
"""Up to this size the window grows by one per answer, above it by one per window of answers."""
FIRST_WINDOW: Final = 2
"""The size that the window starts with: one command is served while one waits."""
WIDEST: Final = 12
"""The most commands in flight: what two connection events of a fast BLE link carry either way."""
_EVENTS: Final = 2
"""Connection events in a round trip over BLE: what a queue takes at once, it takes in each of them."""
_LONG_TRIP: Final = 2
"""Variations by which a long round trip exceeds the smoothed one.

Commands that are sent at equal distances wait for a connection event, each for another time. Only the longest
wait shows how far apart the events are.
"""
_BURST_LOST, _SPACED_LOST = 1 / 4, 1 / 8
"""Share of lost commands from which on the queue overflows, sent at once and at equal distances."""

_SMOOTHING, _VARIATION = 1 / 8, 1 / 4


class Pace:
    """The pace of one node; ``now`` is any clock in seconds that does not run backwards.

    A robot serves its commands in order. So all commands sent before an answered one were served, too. They
    take no place in the window any more, though their own answers may still arrive.

    Attributes:
        timeout: seconds until a command counts as silent: the smoothed round trip and four variations of it
            [RFC 6298], but at least two round trips, as a growing window makes them longer.
        round_trip: smoothed, in seconds; None until an answer was timed.
    """

    def __init__(self, timeout: float | None = None, window: int | None = None) -> None:
        """Fix the timeout or the window; None lets it adapt."""
        self.timeout = FIRST_TIMEOUT if timeout is None else timeout
        self.round_trip: float | None = None
        self._fixed_timeout = timeout is not None
        self._fixed_window = window
        self._variation = 0.0
        self._window: float = FIRST_WINDOW
        self._threshold: float = SLOW_START
        self._narrowed_at = self._slowed_at = self._full_at = float("-inf")
        self._sent: dict[int, float] = {}
        self._owed = 0
        self._doubtful: set[int] = set()
        self._late: set[int] = set()
        self._overflow, self._overflow_spaced = Overflow(_BURST_LOST), Overflow(_SPACED_LOST)
        self._crowds: dict[int, Crowd] = {}
        self._sent_at = float("-inf")

    @property
    def window(self) -> int:
        """How many commands may be in flight."""
        if self._fixed_window:
            return self._fixed_window
        return int(min(self._window, self._ceiling) if self.is_spaced else self._window)

    @property
    def is_spaced(self) -> bool:
        """Whether commands are sent at equal distances: sent at once, they overflowed the node's queue."""
        return self._overflow.ceiling < inf

    @property
    def ready_at(self) -> float:
        """When the next command may be sent, if the window has a place for it."""
        if not self.is_spaced or self.round_trip is None:
            return self._sent_at
        return self._sent_at + (self.round_trip + _LONG_TRIP * self._variation) / self.window

    @property
    def _ceiling(self) -> float:
        if not self.is_spaced:
            return self._overflow.ceiling
        return min(self._overflow_spaced.ceiling, _EVENTS * self._overflow.ceiling)

    @property
    def longest_timeout(self) -> float:
        """Seconds that the timeout can grow to."""
        return self.timeout if self._fixed_timeout else LONGEST_TIMEOUT

    @property
    def in_flight(self) -> int:
        """How many commands the node's queue may still hold."""
        return len(self._sent)

    def sent(self, seq: int, *, now: float, doubtful: bool = False) -> None:
        """Record that a command is sent; a doubtful one was silent before, and likely is again."""
        self._sent[seq] = now
        (self._doubtful.add if doubtful else self._doubtful.discard)(seq)
        self._late.discard(seq)
        self._crowds[seq] = Crowd(self.in_flight, self.is_spaced)
        self._sent_at = now
        if self.in_flight >= self.window:
            self._full_at = now

    @property
    def patience(self) -> float:
        """Seconds from the first attempt of a command on in which it must not be called silent."""
        if self._fixed_timeout or self.round_trip is None:
            return self.timeout
        return max(SHORTEST_PATIENCE, PATIENT_ROUND_TRIPS * self.round_trip)

    @property
    def grace(self) -> float:
        """Seconds to wait for an overtaken command."""
        return max(GRACE, 4 * self._variation)

    def answered(self, seq: int, round_trip: float, *, now: float, busy: bool = False) -> list[int]:
        """Record an answer; return the sequence numbers of the commands that it overtook.

        Args:
            seq: the command's number.
            round_trip: seconds since it was sent. Each attempt has its own sequence number, so this is exact.
            now: the time.
            busy: the node answered that it is busy.
        """
        sent = self._sent.get(seq, now - round_trip)
        if busy:  # rejected unserved: it overtook nothing, and its round trip is not that of a served command
            self.forget(seq)
            self._narrow(sent, now)
            return []
        self._time(round_trip)
        if seq in self._crowds:
            crowd = self._crowds[seq]
            self._overflow_of(crowd).answered(crowd.in_flight)
        overtaken: list[int] = []
        if seq in self._sent:
            if next(iter(self._sent)) != seq:
                in_order = list(self._sent)
                overtaken = in_order[: in_order.index(seq)]
                for served in overtaken:
                    del self._sent[served]
            del self._sent[seq]
        self._owed += sum(served not in self._doubtful for served in overtaken)
        if sent <= self._full_at:  # only a full window shows that the node keeps up
            self._grow()
        return overtaken

    def silent(self, seq: int, waited: float, *, now: float, expected: bool = False) -> None:
        """Record that no answer arrived in time.

        Args:
            seq: the command's number.
            waited: seconds since it was sent.
            now: the time.
            expected: an answer was certain, so too many commands were in flight.
        """
        sent = self._sent.get(seq, now - waited)
        if seq in self._sent and sent >= self._slowed_at and not self._fixed_timeout:
            self.timeout = max(self.timeout, min(LONGEST_BACKOFF, self.timeout * BACKOFF))
            self._slowed_at = now
        self.forget(seq)
        if expected:
            self._narrow(sent, now)

    def crowd(self, seq: int) -> Crowd:
        """Return what a command was sent into."""
        return self._crowds.get(seq, Crowd(1))

    def overflows(self, crowd: Crowd) -> bool:
        """Whether the node's queue is known to be too small for a command that is sent into so many."""
        return crowd.in_flight > self._overflow_of(crowd).ceiling

    def lost(self, seq: int) -> int:
        """Record that a silent command was lost, because it is answered when it is sent again.

        Args:
            seq: the number of the silent attempt.

        Returns:
            How many losses, this one or earlier ones, are now known to be no fault of the radio: too many
            commands were in flight for the node's queue, or the answer was only late.
        """
        if seq in self._late:
            return 1
        crowd, spaced_before = self.crowd(seq), self.is_spaced
        explained = self._overflow_of(crowd).lost(crowd.in_flight)
        if self.is_spaced and not spaced_before:
            self._window = self._threshold = max(1.0, self._overflow.ceiling)
        return explained

    def _overflow_of(self, crowd: Crowd) -> Overflow:
        return self._overflow_spaced if crowd.is_spaced else self._overflow

    def answered_late(self, seq: int, took: float) -> None:
        """Record that an answer arrived after its command counted as silent, and raise the timeout.

        Args:
            seq: the command's number.
            took: seconds since the command was sent.
        """
        self._late.add(seq)
        if not self._fixed_timeout:
            self.timeout = max(self.timeout, min(LONGEST_TIMEOUT, LATE_MARGIN * took))

    def forget(self, seq: int) -> None:
        """Record that a command is not waited for any more."""
        self._sent.pop(seq, None)

    def _grow(self) -> None:
        """Widen the window, unless as many commands were overtaken as answered: they may be lost."""
        if self._owed:
            self._owed -= 1
        elif self._window < self._ceiling:
            grown = 1.0 if self._window < self._threshold else 1 / self._window
            self._window = min(WIDEST, self._window + grown)

    def _narrow(self, sent: float, now: float) -> None:
        """Halve the window, once for all commands that were sent before that took effect."""
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
