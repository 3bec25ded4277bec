"""What goes out next: probes and canaries stand in line, and leave as the robot has room for them."""

import asyncio
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Final, NamedTuple

from sphero_probe.link.exchange import Exchange
from sphero_probe.probing.asking import Asked, Asker, Tried
from sphero_probe.probing.canary import Canary
from sphero_probe.probing.flight import ATTEMPTS, Flight
from sphero_probe.probing.proving import Endings, Proofs
from sphero_probe.protocol.packets import Command

ROUND: Final = 16
"""Probes between two canaries."""
SECONDS: Final = 2.0
"""Seconds between two canaries, as long as there are probes."""
_QUESTIONS: Final = 2
"""Commands that a canary is made of."""


class Question(NamedTuple):
    """One question of a canary, on its way."""

    canary: int
    command: Command
    attempt: int = 1


class Sender:
    """Three lines to stand in, and what is in flight.

    Attributes:
        flight: what was sent and has not ended.
        todo: probes that were not asked yet.
        again: probes that stayed silent.
        questions: of canaries.
        nodes: addresses that the last canary was asked of.
        is_last: nothing more will come, so that a canary need not wait for more probes to prove.
        width: things in flight at most, None for as many as the robot bears.
    """

    def __init__(
        self, asker: Asker, canary: Canary, proofs: Proofs, on_proof: Callable[[Endings], None]
    ) -> None:
        self.flight: Flight[Asked | Question, Tried | Exchange] = Flight(lambda: proofs.canaries)
        self.todo: deque[Asked] = deque()
        self.again: deque[Asked] = deque()
        self.questions: deque[Question] = deque()
        self.nodes: set[int | None] = set()
        self.is_last = False
        self.width: int | None = None
        self._asker = asker
        self._canary = canary
        self._proofs = proofs
        self._on_proof = on_proof
        self._since_canary = 0
        self._in_vain = 0
        self._canary_at = float("-inf")

    @property
    def is_idle(self) -> bool:
        """Whether nobody stands in line and nothing is in flight."""
        return not (self.flight or self.todo or self.again or self.questions)

    def clear(self) -> None:
        """Let nobody stand in line any more."""
        for line in (self.todo, self.again, self.questions):
            line.clear()

    def send(self) -> None:
        """Send canaries when they are due, what is asked again, and new probes, as long as there is room."""
        while line := self._next_line():
            thing = line[0]
            if self.flight:
                if self.width and len(self.flight) >= self.width:
                    return
                if self._asker.link.room(thing.command.target) <= self.flight.waiting:
                    return
            self._in_vain = self._in_vain + 1 if line is self.again else 0
            line.popleft()
            if isinstance(thing, Question):
                self.flight.start(thing, partial(self._ask, thing))
            else:
                self._since_canary += 1
                self.flight.start(thing, partial(self._asker.ask, thing, alone=False))

    def _next_line(self) -> deque[Asked] | deque[Question] | None:
        """Return the line whose first is the next to be sent, None when nobody stands in any."""
        now = asyncio.get_running_loop().time()
        due = self._since_canary and (self._since_canary >= ROUND or now - self._canary_at >= SECONDS)
        if due or self._needs_fence or (self.is_idle and self._proofs):
            self._line_up_canary(now)
        if self.questions:
            return self.questions
        if self.again and not (self.todo and self._in_vain):
            return self.again
        return self.todo or None

    @property
    def _needs_fence(self) -> bool:
        """Whether nothing is in flight, or soon will, whose answer would tell of those without one."""
        if self.todo or self.questions or not self._since_canary:
            return False
        if not self.again:
            return self.is_last
        window = self._asker.link.pace(self.again[0].command.target).window
        return self._in_vain >= max(1, window - _QUESTIONS)

    def _line_up_canary(self, now: float) -> None:
        self._since_canary, self._canary_at = 0, now
        self.nodes = self._proofs.nodes | {thing.command.target for thing in self.flight.things}
        questions = [question for target in self.nodes for question in self._canary.questions(target)]
        canary = self._proofs.send(len(questions))
        self.questions += [Question(canary, question) for question in questions]
        if not questions:  # nothing is known that these nodes would answer
            self._on_proof(self._proofs.right(canary, 0))

    async def _ask(self, question: Question, before_sending: Callable[[], None]) -> Exchange:
        alone = question.attempt == ATTEMPTS
        return await self._asker.link.ask(
            question.command, alone=alone, expected=True, before_sending=before_sending
        )
