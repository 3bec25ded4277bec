"""Retries: how often a silent probe is sent again, and what its silence proves in the end."""

from dataclasses import dataclass, field
from math import ceil, inf, log
from typing import Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, LateResponse, Silent
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.finding import Finding

LEAST_ATTEMPTS: Final = 2
"""How often what nobody answers is asked at least, on a line that loses nothing."""
MOST_ATTEMPTS: Final = 12
"""How often what nobody answers is asked at most, however much is lost on the line."""
FALSE_SILENCES: Final = 1e-3
"""How many answered commands of a whole run may be called silent, on average over many runs."""
_SHOWN: Final = 40
"""Damaged bytes that are shown."""
_DOUBT: Final = 20
"""A line counts as losing one command in so many until it is known better."""
LOST: Final = "the link was lost before it was settled"
STOPPED: Final = "stopped before it was asked again"
ONCE: Final = "asked once only: its class is not repeated"
NOT_ITSELF: Final = "the robot was asleep, rebooted or in another mode whenever it was asked"
DEAD: Final = "the node stopped answering as before, and did not recover"
UNCHECKED: Final = "no answer, from a node that answers no health check either"
SUSPECT: Final = "suspect: the link dropped twice while this was asked"
DAMAGED: Final = "no sound answer, but bytes came that may be one"
LOSSY: Final = "no answer, on a line that loses too much to call it silent"
EXECUTED: Final = "the link dropped: it may have been executed"
EXECUTED_BEFORE: Final = "sent before the run was interrupted, may have been executed: not sent again"


class SettledProbe(NamedTuple):
    """How a probe ended.

    Attributes:
        asked: the probe.
        tried: the exchange and how often it was sent.
        doubt: why the exchange proves nothing, empty when it does.
        finding: the judgement, once it was judged.
    """

    asked: PreparedProbe
    tried: ProbeResult
    doubt: str = ""
    finding: Finding | None = None


class LossEstimate:
    """How much the line loses, learned from commands that were answered in the end.

    Attributes:
        probes: how many the run has, as far as that is known.
    """

    def __init__(self) -> None:
        self.probes = 0
        self._sent = 0
        self._lost = 0

    def learn(self, attempts: int) -> None:
        """Take in a command that was answered at this attempt."""
        self._sent += attempts
        self._lost += attempts - 1

    @property
    def attempts_wanted(self) -> int:
        """How often a command must stay silent until chance does not explain it; may be beyond reason."""
        rate = (self._lost + 1) / (self._sent + _DOUBT)
        return max(LEAST_ATTEMPTS, ceil(log(FALSE_SILENCES / max(self.probes, 1)) / log(rate)))


@dataclass(slots=True)
class SilentProbe:
    """A probe that stayed silent so far.

    Attributes:
        asked: the probe.
        silent: its last exchange.
        attempts: how often it was sent.
        confirmed: how many of its silences a passed health check followed.
        late_answer: the answer that came after all.
        doubt: why it will not be asked again, empty when it will.
        sent_at: when each attempt was sent, on the event loop's clock, as far as one may still be answered.
    """

    asked: PreparedProbe
    silent: Silent
    attempts: int
    confirmed: int = 0
    late_answer: Answered | None = None
    doubt: str = ""
    sent_at: list[tuple[Silent, float]] = field(default_factory=list)

    def hear(self, late: LateResponse) -> bool:
        """Take in an answer that may belong to one of the attempts; return whether it does."""
        for silent, _ in self.sent_at:
            if silent is late.earlier:
                command, seq, sent, waited = silent
                took = waited if late.took is None else late.took
                self.late_answer = Answered(command, seq, sent, late.response, late.received, took)
                return True
        return False

    @property
    def first_sent(self) -> float:
        """When it was sent first, on the event loop's clock; minus infinity where it never was."""
        return min((at for _, at in self.sent_at), default=-inf)

    def is_final(self, loss: LossEstimate) -> bool:
        """Whether asking once more would tell nothing new."""
        return self.confirmed >= loss.attempts_wanted or self.attempts >= MOST_ATTEMPTS

    def last_word(self, loss: LossEstimate, interrupted: str, damage: bytes = b"") -> SettledProbe:
        """Return how it ended.

        Args:
            loss: what the line was seen to lose.
            interrupted: why the run ended early, empty when it did not.
            damage: bytes that may be what is left of its answer, empty where none came.
        """
        if self.late_answer:
            return SettledProbe(self.asked, ProbeResult(self.late_answer, self.attempts))
        doubt = self.doubt
        if not doubt and self.confirmed < loss.attempts_wanted:
            doubt = interrupted or (ONCE if self.asked.risk > Risk.WRITE else LOSSY)
        if damage and (not doubt or doubt is LOSSY):
            doubt = f"{DAMAGED}: {damage[:_SHOWN].hex(' ')}"
        return SettledProbe(self.asked, ProbeResult(self.silent, self.attempts), doubt)


def silence(asked: PreparedProbe) -> Silent:
    """Return the exchange of a probe of which nothing is known."""
    return Silent(asked.command, 0, b"", 0.0)


def no_result(asked: PreparedProbe, attempts: int) -> ProbeResult:
    """Return how a probe ended that proved nothing at all."""
    return ProbeResult(silence(asked), attempts)
