"""What goes out next: probes and canaries stand in line, and leave as the robot has room for them."""

import asyncio
from collections import deque
from collections.abc import Callable
from functools import partial
from itertools import islice
from typing import Final, NamedTuple

from sphero_probe.link.exchange import Exchange
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.confirmation import Confirmations, Confirmed
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.inflight import InFlight
from sphero_probe.probing.prober import Prober
from sphero_probe.protocol.packets import Command

PROBES_PER_CHECK: Final = 16
"""Probes between two canaries."""
SECONDS_PER_CHECK: Final = 2.0
"""Seconds between two canaries, as long as there are probes."""
_LOOK_AHEAD: Final = 16
"""Probes of a queue that are looked at for one that may go now."""
_QUESTIONS: Final = 2
"""Commands that a canary is made of."""


class HealthQuestion(NamedTuple):
    """One question of a canary, on its way."""

    health: int
    command: Command
    attempt: int = 1


class Scheduler:
    """Three lines to stand in, and what is in flight.

    Attributes:
        in_flight_probes: what was sent and has not ended.
        todo: probes that were not asked yet.
        again: probes that stayed silent.
        questions: of canaries.
        is_last: nothing more will come, so that a canary need not wait for more probes to prove.
        width: things in flight at most, None for as many as the robot bears.
    """

    def __init__(
        self,
        prober: Prober,
        health: HealthCheck,
        confirmations: Confirmations,
        on_confirmed: Callable[[Confirmed], None],
    ) -> None:
        self.in_flight_probes: InFlight[PreparedProbe | HealthQuestion, ProbeResult | Exchange] = InFlight(
            lambda: confirmations.checks
        )
        self.todo: deque[PreparedProbe] = deque()
        self.again: deque[PreparedProbe] = deque()
        self.questions: deque[HealthQuestion] = deque()
        self.is_last = False
        self.width: int | None = None
        self._prober = prober
        self._health = health
        self._confirmations = confirmations
        self._on_confirmed = on_confirmed
        self._since_check = 0
        self._in_vain = 0
        self._checked_at = float("-inf")

    @property
    def is_idle(self) -> bool:
        """Whether nobody stands in line and nothing is in flight."""
        return not (self.in_flight_probes or self.todo or self.again or self.questions)

    def clear(self) -> None:
        """Let nobody stand in line any more."""
        for line in (self.todo, self.again, self.questions):
            line.clear()

    def send(self) -> None:
        """Send due health checks, retries and new probes, as long as there is room."""
        while queue := self._next_queue():
            item = self._next_item(queue)
            if item is None:
                return
            if self.in_flight_probes:
                if self.width and len(self.in_flight_probes) >= self.width:
                    return
                if self._prober.link.room(item.command.target) <= self.in_flight_probes.waiting:
                    return
            self._in_vain = self._in_vain + 1 if queue is self.again else 0
            queue.remove(item)  # type: ignore[arg-type]
            if isinstance(item, HealthQuestion):
                self.in_flight_probes.start(item, partial(self._ask, item))
            else:
                self._since_check += 1
                self.in_flight_probes.start(item, partial(self._prober.ask, item, alone=False))

    def _next_item(
        self, queue: deque[PreparedProbe] | deque[HealthQuestion]
    ) -> PreparedProbe | HealthQuestion | None:
        """Return the first of a queue that may go now, None when each must wait for what is in flight."""
        first = queue[0]
        if isinstance(first, HealthQuestion) or not first.is_wrong_length:
            return first
        for item in islice(queue, _LOOK_AHEAD):
            if isinstance(item, PreparedProbe) and self._may_go(item):
                return item
        return None

    def _may_go(self, probe: PreparedProbe) -> bool:
        """Whether a probe may go now: at most one at a time may reach a command that accepts its length."""
        if not probe.is_wrong_length:
            return True
        target = probe.command.target
        flying = [
            other
            for other in self.in_flight_probes.items
            if isinstance(other, PreparedProbe) and other.is_wrong_length and other.command.target == target
        ]
        if not self._is_proved(probe):
            return not flying
        return all(self._is_proved(other) and not (probe.may_exist and other.may_exist) for other in flying)

    def _is_proved(self, probe: PreparedProbe) -> bool:
        return self._prober.is_proved(probe.command.target, probe.command.did)

    def _next_queue(self) -> deque[PreparedProbe] | deque[HealthQuestion] | None:
        """Return the queue to send from next, None when all are empty."""
        now = asyncio.get_running_loop().time()
        due = self._since_check and (
            self._since_check >= PROBES_PER_CHECK or now - self._checked_at >= SECONDS_PER_CHECK
        )
        if due or self._needs_fence or (self.is_idle and self._confirmations):
            self._queue_check(now)
        if self.questions:
            return self.questions
        if self.again and not (self.todo and self._in_vain):
            return self.again
        return self.todo or None

    @property
    def _needs_fence(self) -> bool:
        """Whether nothing is in flight, or soon will, whose answer would tell of those without one."""
        if self.todo or self.questions or not self._since_check:
            return False
        if not self.again:
            return self.is_last
        window = self._prober.link.pace(self.again[0].command.target).window
        return self._in_vain >= max(1, window - _QUESTIONS)

    def _queue_check(self, now: float) -> None:
        self._since_check, self._checked_at = 0, now
        nodes = self._confirmations.nodes | {item.command.target for item in self.in_flight_probes.items}
        questions = [question for target in nodes for question in self._health.questions(target)]
        health = self._confirmations.send(len(questions))
        self.questions += [HealthQuestion(health, question) for question in questions]
        if not questions:  # nothing is known that these nodes would answer
            self._on_confirmed(self._confirmations.right(health, 0))

    async def _ask(self, question: HealthQuestion, before_sending: Callable[[], None]) -> Exchange:
        alone = question.attempt == MAX_ATTEMPTS
        return await self._prober.link.ask(
            question.command, alone=alone, expected=True, before_sending=before_sending
        )
