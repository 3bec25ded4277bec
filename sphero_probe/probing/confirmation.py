"""Keep track of which results are confirmed by a passed health check.

A robot serves its commands in order. So a health check that passes confirms everything that was sent before
it.
"""

from typing import NamedTuple

from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.retries import SettledProbe


class Confirmed(NamedTuple):
    """Probes whose result a health check confirmed.

    Attributes:
        answered: probes with an answer.
        silent: probes without one.
    """

    answered: list[SettledProbe]
    silent: list[PreparedProbe]


class Confirmations:
    """Results that wait for a health check that was sent after their probe.

    Attributes:
        checks: how many health checks were sent so far; the next one confirms what is sent now.
    """

    def __init__(self) -> None:
        self.checks = 0
        self._answered: list[tuple[int, SettledProbe]] = []
        self._silent: list[tuple[int, PreparedProbe]] = []
        self._open: dict[int, int] = {}
        self._confirmed_to = 0

    def __bool__(self) -> bool:
        """Whether any result is not confirmed yet."""
        return bool(self._answered or self._silent)

    @property
    def nodes(self) -> set[int | None]:
        """Addresses of the nodes with results that are not confirmed yet."""
        answered = {settled.probe.command.target for _, settled in self._answered}
        return answered | {probe.command.target for _, probe in self._silent}

    def answer(self, settled: SettledProbe, stamp: int) -> Confirmed:
        """Add an answer; return what is confirmed now.

        Args:
            settled: the probe and its answer.
            stamp: what ``checks`` was when it was sent.
        """
        self._answered.append((stamp, settled))
        return self._confirmed()

    def silence(self, probe: PreparedProbe, stamp: int) -> Confirmed:
        """Add a probe that stayed silent; return what is confirmed now.

        Args:
            probe: the probe.
            stamp: what ``checks`` was when it was sent.
        """
        self._silent.append((stamp, probe))
        return self._confirmed()

    def send(self, questions: int) -> int:
        """Record that a health check of so many questions is sent; return its number."""
        self.checks += 1
        self._open[self.checks] = questions
        return self.checks

    def needs(self, check: int) -> bool:
        """Whether the result of this health check still matters: no later one has passed."""
        return check in self._open

    def passed(self, check: int, questions: int = 1) -> Confirmed:
        """Record correct answers to questions of a health check; return what is confirmed now."""
        self._open[check] -= questions
        if not self._open[check]:
            self._confirmed_to = check
            for earlier in [number for number in self._open if number <= check]:
                del self._open[earlier]
        return self._confirmed()

    def clear(self) -> Confirmed:
        """Forget every health check; return the results that none of them confirmed."""
        left = Confirmed([settled for _, settled in self._answered], [probe for _, probe in self._silent])
        self._answered.clear()
        self._silent.clear()
        self._open.clear()
        return left

    def _confirmed(self) -> Confirmed:
        confirmed = Confirmed(
            [settled for stamp, settled in self._answered if stamp < self._confirmed_to],
            [probe for stamp, probe in self._silent if stamp < self._confirmed_to],
        )
        if confirmed.answered:
            self._answered = [entry for entry in self._answered if entry[0] >= self._confirmed_to]
        if confirmed.silent:
            self._silent = [entry for entry in self._silent if entry[0] >= self._confirmed_to]
        return confirmed
