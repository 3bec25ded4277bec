"""Decide what is sent next: a question of a health check, a retry or a new probe, as the robot has room."""

import asyncio
from collections import deque
from collections.abc import Callable
from functools import partial
from itertools import islice
from typing import Final, NamedTuple

from sphero_probe.link.exchange import Exchange, Silent
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.confirmation import Confirmations, Confirmed
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.inflight import InFlight
from sphero_probe.probing.prober import Prober
from sphero_probe.protocol.packets import Command

PROBES_PER_CHECK: Final = 24
"""Probes between two health checks."""
SECONDS_PER_CHECK: Final = 2.0
"""Seconds between two health checks, as long as there are probes."""
LOOK_AHEAD: Final = 16
"""How far into a queue to look for a probe that may be sent now."""
_LONG_WAIT: Final = 3
"""Round trips of a timeout from which on a check tells sooner that a probe is silent."""
_QUESTIONS_PER_CHECK: Final = 2
"""Commands of one health check."""


class HealthQuestion(NamedTuple):
    """One question of a health check.

    Attributes:
        check: number of the health check.
        command: to send.
        attempt: from 1.
        lost: sequence numbers of the attempts that were silent.
    """

    check: int
    command: Command
    attempt: int = 1
    lost: tuple[int, ...] = ()

    def again(self, exchange: Exchange) -> "HealthQuestion":
        """Return the question for the next attempt, after one that told nothing."""
        lost = (*self.lost, exchange.seq) if isinstance(exchange, Silent) else self.lost
        return self._replace(attempt=self.attempt + 1, lost=lost)


_Queue = deque[PreparedProbe] | deque[HealthQuestion]


class Scheduler:
    """Three queues, and what is in flight.

    Attributes:
        in_flight_probes: probes and questions that were sent and have not ended.
        todo: probes that were not sent yet.
        again: silent probes to send again.
        questions: of health checks.
        is_last: no more probes follow, so the last health check need not wait for any.
        was_silent: the last probe that ended got no answer.
        width: the most items in flight, None for as many as the robot takes.
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
        self.is_last = self.was_silent = False
        self.width: int | None = None
        self._prober = prober
        self._health = health
        self._confirmations = confirmations
        self._on_confirmed = on_confirmed
        self._since_check = 0
        self._retries_in_a_row = 0
        self._checked_at = float("-inf")

    @property
    def is_idle(self) -> bool:
        """Whether all queues are empty and nothing is in flight."""
        return not (self.in_flight_probes or self.todo or self.again or self.questions)

    def clear(self) -> None:
        """Empty all queues."""
        for line in (self.todo, self.again, self.questions):
            line.clear()

    def send(self) -> None:
        """Send due health checks, retries and new probes, as long as there is room."""
        while following := self._next():
            queue, item = following
            if self.in_flight_probes:
                if self.width and len(self.in_flight_probes) >= self.width:
                    return
                if self._prober.link.room(item.command.target) <= self.in_flight_probes.waiting:
                    return
            self._retries_in_a_row = self._retries_in_a_row + 1 if queue is self.again else 0
            queue.remove(item)  # type: ignore[arg-type]
            if isinstance(item, HealthQuestion):
                self.in_flight_probes.start(item, partial(self._ask, item))
            else:
                self._since_check += 1
                self.in_flight_probes.start(item, partial(self._prober.ask, item, alone=False))

    def _next(self) -> tuple[_Queue, PreparedProbe | HealthQuestion] | None:
        """Return what is sent next, and the queue that it is in; None if all must wait."""
        for queue in self._queues():
            if queue and (item := self._next_item(queue)):
                return queue, item
        return None

    def _next_item(self, queue: _Queue) -> PreparedProbe | HealthQuestion | None:
        """Return the first item of a queue that may be sent now, None if all must wait."""
        first = queue[0]
        if isinstance(first, HealthQuestion) or not first.is_wrong_length:
            return first
        for item in islice(queue, LOOK_AHEAD):
            if isinstance(item, PreparedProbe) and self._may_go(item):
                return item
        return None

    def _may_go(self, probe: PreparedProbe) -> bool:
        """Whether a probe may be sent now.

        At most one probe in flight may reach a command that accepts its wrong length.
        """
        if not probe.is_wrong_length:
            return True
        target = probe.command.target
        dids: set[int] = set()
        for other in self.in_flight_probes.items:
            if not (isinstance(other, PreparedProbe) and other.is_wrong_length):
                continue
            command = other.command
            if command.target == target:
                if probe.may_exist and other.may_exist:
                    return False
                dids.add(command.did)
        return not dids or (
            self._is_proved(probe) and all(self._prober.is_proved(target, did) for did in dids)
        )

    def _is_proved(self, probe: PreparedProbe) -> bool:
        return self._prober.is_proved(probe.command.target, probe.command.did)

    def _queues(self) -> tuple[_Queue, ...]:
        """Return the queues to send from next, the first one that has something to send."""
        now = asyncio.get_running_loop().time()
        due = self._since_check and (
            self._since_check >= PROBES_PER_CHECK
            or now - self._checked_at >= SECONDS_PER_CHECK
            or self._waits_alone
        )
        if due or self._needs_check or (self.is_idle and self._confirmations):
            self._queue_check(now)
        if self.questions:
            return (self.questions,)
        if self._retries_in_a_row:
            return self.todo, self.again
        return self.again, self.todo

    @property
    def _waits_alone(self) -> bool:
        """Whether a probe that others wait for may be silent: an answer to a check soon tells.

        It may if the last one was, or if its timeout is so long that waiting for it costs more than a check.
        """
        flying = self.in_flight_probes.items
        if not self.was_silent and len(flying) > 1:
            return False
        waiting = (item for item in flying if isinstance(item, PreparedProbe) and item.is_wrong_length)
        probe = next((item for item in waiting if not self._is_proved(item)), None)
        if probe is None or self.was_silent:
            return probe is not None
        pace = self._prober.link.pace(probe.command.target)
        return pace.timeout > _LONG_WAIT * (pace.round_trip or pace.timeout)

    @property
    def _needs_check(self) -> bool:
        """Whether a health check is needed because no other command will confirm the silent probes."""
        if self.todo or self.questions or not self._since_check:
            return False
        if not self.again:
            return self.is_last
        window = self._prober.link.pace(self.again[0].command.target).window
        return self._retries_in_a_row >= max(1, window - _QUESTIONS_PER_CHECK)

    def _queue_check(self, now: float) -> None:
        self._since_check, self._checked_at = 0, now
        nodes = self._confirmations.nodes | {item.command.target for item in self.in_flight_probes.items}
        questions = {target: self._health.questions(target) for target in nodes}
        shortened = {
            target for target, asked in questions.items() if len(asked) > 1 and self._may_shorten(target)
        }
        questions |= {target: questions[target][:1] for target in shortened}
        sent = {target: len(asked) for target, asked in questions.items()}
        check = self._confirmations.send(sent, shortened)
        for target, asked in questions.items():
            self.questions += [HealthQuestion(check, question) for question in asked]
            if not asked:  # this node answers no health check
                self._on_confirmed(self._confirmations.passed(check, target, 0))

    def _may_shorten(self, target: int | None) -> bool:
        """Whether the first question is enough, because a probe that follows will answer the second."""
        return not (self.is_last or self._confirmations.wants_absent(target))

    async def _ask(self, question: HealthQuestion, before_sending: Callable[[], None]) -> Exchange:
        alone = question.attempt == MAX_ATTEMPTS
        return await self._prober.link.ask(
            question.command, alone=alone, expected=True, before_sending=before_sending
        )
