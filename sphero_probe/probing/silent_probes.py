"""The probes of a run that are silent so far, and what may still answer or explain their silence."""

import asyncio
from collections.abc import Callable, Iterable, Iterator
from math import inf

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import LateResponse, Silent
from sphero_probe.link.overflow import Crowd
from sphero_probe.link.pacing import Pace
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.executions import Executions
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.late_answers import LOOK, SLOWEST, LateAnswers
from sphero_probe.probing.near_misses import NearMisses
from sphero_probe.probing.retries import LOST, UNCHECKED, LossEstimate, SettledProbe, SilentProbe, silence
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Malformed


class SilentProbes:
    """Collects silent probes until each is answered, sent again or settled as silent.

    Attributes:
        loss: how much the link loses.
    """

    def __init__(self, codec: Codec, executions: Executions, loss: LossEstimate) -> None:
        self.loss = loss
        self._by_number: dict[int, SilentProbe] = {}
        self._executions = executions
        self._near_misses = NearMisses(codec)
        self._late = LateAnswers()

    def __iter__(self) -> Iterator[SilentProbe]:
        """Iterate over those that are silent so far."""
        return iter(self._by_number.values())

    def __contains__(self, number: int) -> bool:
        """Whether the probe of this number is silent so far."""
        return number in self._by_number

    def get(self, number: int) -> SilentProbe | None:
        """Return the silent probe of this number, None if it is not silent."""
        return self._by_number.get(number)

    def add(self, probe: PreparedProbe, exchange: Silent, attempts: int, crowd: Crowd) -> SilentProbe:
        """Record a silent attempt, which a health check must confirm.

        Args:
            probe: the probe.
            exchange: of this attempt.
            attempts: all so far.
            crowd: what it was sent into.
        """
        silent = self._by_number.setdefault(probe.number, SilentProbe(probe, exchange, 0))
        silent.exchange, silent.attempts = exchange, attempts
        silent.is_queued = False
        silent.crowds.append(crowd)
        silent.sent_at.append((exchange, asyncio.get_running_loop().time() - exchange.waited))
        return silent

    def add_lost(self, probe: PreparedProbe) -> None:
        """Add a probe whose answer a dropped link may have taken along."""
        self._by_number[probe.number] = SilentProbe(probe, silence(probe), 1, doubt=LOST)

    def discard(self, number: int) -> None:
        """Forget a probe that was answered or settled."""
        self._by_number.pop(number, None)

    def next_try(self, silent: SilentProbe, patience: float) -> PreparedProbe | None:
        """Return the probe to send again; None if its silence is certain or its class forbids it.

        Args:
            silent: the probe.
            patience: seconds from its first attempt on in which it must not be settled as silent.
        """
        if silent.late_answer or silent.doubt or silent.probe.risk > Risk.WRITE or silent.is_final(self.loss):
            return None
        if silent.is_queued:
            return None
        silent.is_queued = True
        is_last = silent.confirmed + silent.unconfirmed + 1 >= self.loss.attempts_wanted
        wait_until = silent.first_sent + patience if is_last else 0.0
        return silent.probe._replace(wait_until=wait_until, was_silent=True)

    def learn_lost(self, pace: Pace, target: int | None, numbers: Iterable[int]) -> None:
        """Record that commands were lost; silences that a full queue explains do not count.

        Args:
            pace: of the node.
            target: the node.
            numbers: the sequence numbers of the commands.
        """
        excused = sum(map(pace.lost, numbers))
        self.loss.excuse(excused)
        for silent in self if excused else ():
            if silent.probe.command.target == target:
                silent.discount(pace.overflows)

    def hear(self, unsolicited: Malformed | LateResponse) -> None:
        """Process a late answer, which still settles its own probe, or bytes that fit no command."""
        self._near_misses.hear(unsolicited, now=asyncio.get_running_loop().time())
        if isinstance(unsolicited, LateResponse):
            answered = (silent for silent in self if silent.hear(unsolicited))
            silent = next(answered, None) or self._late.hear(unsolicited)
            if silent and silent.late_answer:
                self._executions.learn(silent.probe, silent.late_answer)

    @property
    def late_until(self) -> float | None:
        """When waiting for late answers will end, on the clock of the loop; None if no probe is silent."""
        since = max((silent.first_sent for silent in self), default=-inf)
        since = max(since, self._late.last_sent)
        return since + SLOWEST if since > -inf else None

    async def wait_together(self, seconds: float, is_over: Callable[[], bool]) -> None:
        """Wait for an answer to each of them, at most so many seconds from its first attempt on."""
        now = asyncio.get_running_loop().time
        while not is_over():
            waiting = (silent.first_sent for silent in self if not silent.late_answer)
            remaining = max(waiting, default=-inf) + seconds - now()
            if remaining <= 0:
                break
            await asyncio.sleep(min(remaining, LOOK))

    def settle_all(self, health: HealthCheck, interrupted: str) -> list[SettledProbe]:
        """Return how all of them ended; a late answer may still change that, see ``wait_for_late``.

        Args:
            health: of the nodes; a silence that no health check confirms is in doubt.
            interrupted: why the run ended early, empty if it did not.
        """
        ended: list[SettledProbe] = []
        for silent in self:
            if not health.has_questions(silent.probe.command.target):
                silent.doubt = silent.doubt or UNCHECKED
            ended.append(silent.settle(self.loss, interrupted, self._near_misses.of(silent.sent_at)))
            if not silent.late_answer:
                self._late.watch(silent)
        self._by_number.clear()
        return ended

    async def wait_for_late(self, is_over: Callable[[], bool]) -> list[SettledProbe]:
        """Wait for late answers to all settled silent probes; return those that were answered.

        Args:
            is_over: whether the run was ended.
        """
        answered = await self._late.wait(is_over, SLOWEST)
        await self._executions.report()
        return [silent.settle(self.loss, "") for silent in answered]
