"""Decide how often a silent probe is sent again, and what its silence proves in the end."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil, inf, log, sqrt
from typing import Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, LateResponse, Silent
from sphero_probe.link.overflow import Crowd
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.finding import Finding

LEAST_ATTEMPTS: Final = 2
"""The fewest times a silent probe is sent, over a link that loses nothing."""
MOST_ATTEMPTS: Final = 12
"""The most times a silent probe is sent, however much the link loses."""
FALSE_SILENCES: Final = 1e-3
"""How many commands per run may be wrongly called silent, on average over many runs."""
_SHOWN: Final = 40
"""Damaged bytes that a note shows."""
_DOUBT: Final = 20
"""A link is assumed to lose one command in so many, until more is known."""
_LUCK: Final = 2
"""Standard deviations by which a link is assumed to lose more than was seen: a short run may be lucky."""
LOST: Final = "the link was lost before this was settled"
STOPPED: Final = "stopped before this was sent again"
ONCE: Final = "sent only once: commands of this class are not repeated"
NOT_ITSELF: Final = "the robot was asleep, rebooted or in another mode each time this was sent"
DEAD: Final = "the node does not answer, or not as before"
UNCHECKED: Final = "no answer, and the node answers no health check either"
SUSPECT: Final = "suspect: the link dropped twice while this was in flight"
DAMAGED: Final = "no valid answer, but bytes arrived that may be one"
LOSSY: Final = "no answer, over a link that loses too much to call this silent"
EXECUTED: Final = "the link dropped: this may have been executed"
EXECUTED_BEFORE: Final = "sent before the run was interrupted and may have been executed: not sent again"


class SettledProbe(NamedTuple):
    """How a probe ended.

    Attributes:
        probe: the probe.
        result: the exchange and how often the probe was sent.
        doubt: why the exchange proves nothing, empty if it proves something.
        finding: once the probe is judged.
    """

    probe: PreparedProbe
    result: ProbeResult
    doubt: str = ""
    finding: Finding | None = None


class LossEstimate:
    """Estimates how much the link loses, from commands that were answered in the end.

    Attributes:
        probes: how many the run has, as far as is known.
    """

    def __init__(self) -> None:
        self.probes = 0
        self._sent = 0
        self._lost = 0

    def learn(self, attempts: int) -> None:
        """Record a command that was answered at this attempt."""
        self._sent += attempts
        self._lost += attempts - 1

    def excuse(self, losses: int) -> None:
        """Take back losses that were learned: too many commands were in flight."""
        self._sent -= losses
        self._lost -= losses

    @property
    def attempts_wanted(self) -> int:
        """How many silences chance does not explain any more; may exceed ``MOST_ATTEMPTS``."""
        lost = max(0, self._lost)
        rate = (lost + _LUCK * sqrt(lost) + 1) / (max(0, self._sent) + _DOUBT)
        return max(LEAST_ATTEMPTS, ceil(log(FALSE_SILENCES / max(self.probes, 1)) / log(rate)))


@dataclass(slots=True)
class SilentProbe:
    """A probe that is silent so far.

    Attributes:
        probe: the probe.
        exchange: of its last attempt.
        attempts: how often it was sent.
        confirmed: how many of its silences a health check confirmed.
        late_answer: the answer that arrived after all.
        doubt: why it will not be sent again, empty if it may be.
        sent_at: each attempt that may still be answered, with its time on the event loop's clock.
        crowds: what it was sent into each time, confirmed silences first.
        is_queued: it waits to be sent again, or was sent and has not ended.
    """

    probe: PreparedProbe
    exchange: Silent
    attempts: int
    confirmed: int = 0
    late_answer: Answered | None = None
    doubt: str = ""
    sent_at: list[tuple[Silent, float]] = field(default_factory=list)
    crowds: list[Crowd] = field(default_factory=list)
    is_queued: bool = False

    def hear(self, late: LateResponse) -> bool:
        """Take an answer if it belongs to one of the attempts; return whether it does."""
        for silent, _ in self.sent_at:
            if silent is late.earlier:
                command, seq, sent, waited = silent
                took = waited if late.took is None else late.took
                self.late_answer = Answered(command, seq, sent, late.response, late.received, took)
                return True
        return False

    @property
    def first_sent(self) -> float:
        """When it was first sent, on the event loop's clock; minus infinity if it never was."""
        return min((at for _, at in self.sent_at), default=-inf)

    @property
    def unconfirmed(self) -> int:
        """How many of its silences still wait for a health check."""
        return max(0, len(self.crowds) - self.confirmed)

    def confirm(self, overflows: Callable[[Crowd], bool]) -> None:
        """Count the first unconfirmed silence; see ``discount`` for the argument."""
        self.confirmed += 1
        self.discount(overflows)

    def discount(self, overflows: Callable[[Crowd], bool]) -> None:
        """Do not count silences that a full queue explains.

        Args:
            overflows: whether the node's queue is too small for a command that is sent into so many.
        """
        counted = [crowd for crowd in self.crowds[: self.confirmed] if not overflows(crowd)]
        self.crowds[: self.confirmed] = counted
        self.confirmed = len(counted)

    def is_final(self, loss: LossEstimate) -> bool:
        """Whether sending it once more would prove nothing new, if its silences are confirmed."""
        silences = self.confirmed + self.unconfirmed
        return silences >= loss.attempts_wanted or self.attempts >= MOST_ATTEMPTS

    def settle(self, loss: LossEstimate, interrupted: str, damage: bytes = b"") -> SettledProbe:
        """Return how it ended.

        Args:
            loss: how much the link loses.
            interrupted: why the run ended early, empty if it did not.
            damage: bytes that may be its damaged answer, empty if there are none.
        """
        if self.late_answer:
            return SettledProbe(self.probe, ProbeResult(self.late_answer, self.attempts))
        doubt = self.doubt
        if not doubt and self.confirmed < loss.attempts_wanted:
            doubt = interrupted or (ONCE if self.probe.risk > Risk.WRITE else LOSSY)
        if damage and (not doubt or doubt is LOSSY):
            doubt = f"{DAMAGED}: {damage[:_SHOWN].hex(' ')}"
        return SettledProbe(self.probe, ProbeResult(self.exchange, self.attempts), doubt)


def silence(probe: PreparedProbe) -> Silent:
    """Return a placeholder exchange for a probe without one."""
    return Silent(probe.command, 0, b"", 0.0)


def no_result(probe: PreparedProbe, attempts: int) -> ProbeResult:
    """Return the result of a probe that proved nothing."""
    return ProbeResult(silence(probe), attempts)
