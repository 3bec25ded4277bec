"""Which canary proves what: endings and canaries come in as they happen, what is proved comes out.

A robot serves its commands in order. So a canary that sings proves everything that was sent before it.
"""

from typing import NamedTuple

from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.retries import SettledProbe


class Confirmed(NamedTuple):
    """Probes that ended.

    Attributes:
        answered: those with an answer.
        silent: those without one.
    """

    answered: list[SettledProbe]
    silent: list[PreparedProbe]


class Confirmations:
    """What was sent before a canary is proved once that canary sang.

    Attributes:
        checks: how many were sent so far; what is sent now is proved by the next.
    """

    def __init__(self) -> None:
        self.checks = 0
        self._answered: list[tuple[int, SettledProbe]] = []
        self._silent: list[tuple[int, PreparedProbe]] = []
        self._open: dict[int, int] = {}
        self._confirmed_to = 0

    def __bool__(self) -> bool:
        """Whether anything is left to be proved."""
        return bool(self._answered or self._silent)

    @property
    def nodes(self) -> set[int | None]:
        """Addresses of the nodes with something left to be proved."""
        answered = {settled.asked.command.target for _, settled in self._answered}
        return answered | {asked.command.target for _, asked in self._silent}

    def answer(self, settled: SettledProbe, stamp: int) -> Confirmed:
        """Take in an answer; return what that settles.

        Args:
            settled: the probe and its answer.
            stamp: what ``checks`` was when it was sent.
        """
        self._answered.append((stamp, settled))
        return self._confirmed()

    def silence(self, asked: PreparedProbe, stamp: int) -> Confirmed:
        """Take in that a probe stayed silent; return what that settles.

        Args:
            asked: the probe.
            stamp: what ``checks`` was when it was sent.
        """
        self._silent.append((stamp, asked))
        return self._confirmed()

    def send(self, questions: int) -> int:
        """Take in that a canary of so many questions is sent; return its number."""
        self.checks += 1
        self._open[self.checks] = questions
        return self.checks

    def wants(self, health: int) -> bool:
        """Whether this canary still proves anything: no later one did."""
        return health in self._open

    def right(self, health: int, questions: int = 1) -> Confirmed:
        """Take in right answers to questions of a canary; return what that proves."""
        self._open[health] -= questions
        if not self._open[health]:
            self._confirmed_to = health
            for earlier in [number for number in self._open if number <= health]:
                del self._open[earlier]
        return self._confirmed()

    def clear(self) -> Confirmed:
        """Forget every canary; return what none of them proved."""
        left = Confirmed([settled for _, settled in self._answered], [asked for _, asked in self._silent])
        self._answered.clear()
        self._silent.clear()
        self._open.clear()
        return left

    def _confirmed(self) -> Confirmed:
        confirmed = Confirmed(
            [settled for stamp, settled in self._answered if stamp < self._confirmed_to],
            [asked for stamp, asked in self._silent if stamp < self._confirmed_to],
        )
        if confirmed.answered:
            self._answered = [one for one in self._answered if one[0] >= self._confirmed_to]
        if confirmed.silent:
            self._silent = [one for one in self._silent if one[0] >= self._confirmed_to]
        return confirmed
