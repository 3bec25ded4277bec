"""Which canary proves what: endings and canaries come in as they happen, what is proved comes out.

A robot serves its commands in order. So a canary that sings proves everything that was sent before it.
"""

from typing import NamedTuple

from sphero_probe.probing.asking import Asked
from sphero_probe.probing.pending import Settled


class Endings(NamedTuple):
    """Probes that ended.

    Attributes:
        answered: those with an answer.
        silent: those without one.
    """

    answered: list[Settled]
    silent: list[Asked]


class Proofs:
    """What was sent before a canary is proved once that canary sang.

    Attributes:
        canaries: how many were sent so far; what is sent now is proved by the next.
    """

    def __init__(self) -> None:
        self.canaries = 0
        self._answered: list[tuple[int, Settled]] = []
        self._silent: list[tuple[int, Asked]] = []
        self._open: dict[int, int] = {}
        self._proved_to = 0

    def __bool__(self) -> bool:
        """Whether anything is left to be proved."""
        return bool(self._answered or self._silent)

    @property
    def nodes(self) -> set[int | None]:
        """Addresses of the nodes with something left to be proved."""
        answered = {settled.asked.command.target for _, settled in self._answered}
        return answered | {asked.command.target for _, asked in self._silent}

    def answer(self, settled: Settled, stamp: int) -> Endings:
        """Take in an answer; return what that settles.

        Args:
            settled: the probe and its answer.
            stamp: what ``canaries`` was when it was sent.
        """
        self._answered.append((stamp, settled))
        return self._proved()

    def silence(self, asked: Asked, stamp: int) -> Endings:
        """Take in that a probe stayed silent; return what that settles.

        Args:
            asked: the probe.
            stamp: what ``canaries`` was when it was sent.
        """
        self._silent.append((stamp, asked))
        return self._proved()

    def send(self, questions: int) -> int:
        """Take in that a canary of so many questions is sent; return its number."""
        self.canaries += 1
        self._open[self.canaries] = questions
        return self.canaries

    def wants(self, canary: int) -> bool:
        """Whether this canary still proves anything: no later one did."""
        return canary in self._open

    def right(self, canary: int, questions: int = 1) -> Endings:
        """Take in right answers to questions of a canary; return what that proves."""
        self._open[canary] -= questions
        if not self._open[canary]:
            self._proved_to = canary
            for earlier in [number for number in self._open if number <= canary]:
                del self._open[earlier]
        return self._proved()

    def clear(self) -> Endings:
        """Forget every canary; return what none of them proved."""
        left = Endings([settled for _, settled in self._answered], [asked for _, asked in self._silent])
        self._answered.clear()
        self._silent.clear()
        self._open.clear()
        return left

    def _proved(self) -> Endings:
        proved = Endings(
            [settled for stamp, settled in self._answered if stamp < self._proved_to],
            [asked for stamp, asked in self._silent if stamp < self._proved_to],
        )
        if proved.answered:
            self._answered = [one for one in self._answered if one[0] >= self._proved_to]
        if proved.silent:
            self._silent = [one for one in self._silent if one[0] >= self._proved_to]
        return proved
