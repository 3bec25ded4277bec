"""Learn how many commands in flight make a node lose some, because its queue overflows.

A radio loses packets whatever is in flight. A full queue loses those that were sent while many were waiting.
So losses are counted by how many commands were in flight. It does no I/O and knows no time.
"""

from collections import Counter
from collections.abc import Callable
from typing import Final, NamedTuple

_LEAST_LOST: Final = 2
"""Losses that may be chance: fewer prove nothing."""
_CONTRAST: Final = 2
"""How many times as large the share of lost commands is where a queue overflows."""
_TRUST: Final = 256
"""Answers after which one more command in flight is tried again: the queue may have been full by chance."""


class Crowd(NamedTuple):
    """What a command was sent into.

    Attributes:
        in_flight: how many commands were in flight to the node, itself included.
        is_spaced: they were sent at equal distances, not as fast as they could be written.
    """

    in_flight: int
    is_spaced: bool = False


class Overflow:
    """The most commands in flight that a node's queue takes, as far as is known.

    Attributes:
        ceiling: that number; infinity while no overflow was seen.
    """

    def __init__(self, share: float) -> None:
        """Set the share of lost commands from which on a queue overflows: more than a radio loses."""
        self._share = share
        self.ceiling = float("inf")
        self._answered: Counter[int] = Counter()
        self._lost: Counter[int] = Counter()
        self._since = 0

    def answered(self, in_flight: int) -> None:
        """Record an answer to a command.

        Args:
            in_flight: how many commands were in flight when it was sent, itself included.
        """
        self._answered[in_flight] += 1
        self._since += 1
        if self._since >= _TRUST:
            self._since = 0
            self.ceiling += 1
            for level in [level for level in self._answered if level >= self.ceiling]:
                del self._answered[level]

    def lost(self, in_flight: int) -> int:
        """Record a lost command; return how many losses, this or earlier ones, are now known to be overflows.

        Args:
            in_flight: how many commands were in flight when it was sent, itself included.
        """
        if in_flight > self.ceiling:
            return 1
        self._lost[in_flight] += 1
        for level in sorted(self._lost):
            if level > 1 and self._overflows(level):
                self.ceiling = level - 1
                self._since = 0
                return sum(self._lost.pop(above) for above in list(self._lost) if above >= level)
        return 0

    def _overflows(self, level: int) -> bool:
        """Whether many commands are lost from this level on, and few below it."""
        lost, share = self._losses(lambda other: other >= level)
        _, own = self._losses(lambda other: other == level)
        _, below = self._losses(lambda other: other < level)
        return lost >= _LEAST_LOST and min(share, own) >= self._share and below < share / _CONTRAST

    def _losses(self, chosen: Callable[[int], bool]) -> tuple[int, float]:
        """Return how many commands were lost at the chosen levels, and their share."""
        lost = sum(count for level, count in self._lost.items() if chosen(level))
        answered = sum(count for level, count in self._answered.items() if chosen(level))
        return lost, lost / max(1, lost + answered)
