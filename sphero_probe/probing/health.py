"""Whether the robot is still itself: a node in, yes or no out.

A robot that fell asleep, rebooted or changed its mode answers everything with silence or with something else.
So between probes it is asked two things whose answers are known: an echo, and a command it called absent.
What it said since they were last right is void when they are wrong.
"""

from typing import Final

from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.link.policy import WRONG_LENGTH
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.profiles import GONE
from sphero_probe.protocol.packets import Command, Verdict

_NONCE_BYTES: Final = 4


class HealthCheck:
    """Knows per node which of the two questions a healthy robot answers, and asks them."""

    def __init__(self, prober: Prober) -> None:
        self._prober = prober
        self._questions: dict[int | None, list[Command]] = {}
        self._nonce = 0

    def knows(self, target: int | None) -> bool:
        """Whether it was taken in what this node answers."""
        return target in self._questions

    def has_questions(self, target: int | None) -> bool:
        """Whether a health check of this node can pass or fail."""
        return bool(self._questions.get(target))

    def questions(self, target: int | None) -> list[Command]:
        """Return what to ask this node, the echo with a nonce that was not used before."""
        return [self._with_nonce(question) for question in self._questions.get(target, ())]

    def is_healthy(self, question: Command, exchange: Exchange) -> bool | None:
        """Compare an answer with what a healthy robot says; None where nothing can be told from it."""
        codec = self._prober.link.codec
        match exchange:
            case Answered(response=response):
                verdict = codec.verdict(response.code)
                if verdict is Verdict.BUSY:
                    return None
                if self._is_echo(question):
                    return verdict is Verdict.OK and response.payload == question.payload
                return verdict in GONE
            case Silent():
                return None
            case Blocked():  # whatever was allowed before and is not now says nothing about the robot
                return True

    async def passes(self, target: int | None, attempts: int = MAX_ATTEMPTS) -> bool:
        """Ask alone and compare; the first time only takes in what this node answers rightly.

        Raises:
            LinkLostError: the robot is gone.
        """
        if not self.knows(target):
            candidates = self._candidates(target)
            self._questions[target] = [
                question for question in candidates if await self._passes(question, attempts)
            ]
            return True
        for question in self._questions[target]:
            if not await self._passes(question, attempts):
                return False
        return True

    def _candidates(self, target: int | None) -> list[Command]:
        questions: list[Command] = []
        echo = row_for(self._prober.link.codec.generation, WellKnown.ECHO)
        if echo and self._prober.link.policy.why_blocked(Command(echo.did, echo.cid, b"", target)) is None:
            questions.append(Command(echo.did, echo.cid, b"", target))
        profile = self._prober.profiles.get(target)
        if profile and profile.absent:
            questions.append(profile.absent._replace(payload=bytes(WRONG_LENGTH)))
        return questions

    async def _passes(self, question: Command, attempts: int) -> bool:
        question = self._with_nonce(question)
        for _ in range(attempts):
            right = self.is_healthy(question, await self._prober.link.ask(question, alone=True))
            if right is not None:
                return right
        return False

    def _is_echo(self, question: Command) -> bool:
        echo = row_for(self._prober.link.codec.generation, WellKnown.ECHO)
        return echo is not None and question[:2] == (echo.did, echo.cid)

    def _with_nonce(self, question: Command) -> Command:
        """Fill an echo that takes bytes with some that no earlier one had."""
        echo = row_for(self._prober.link.codec.generation, WellKnown.ECHO)
        if not (echo and echo.request and self._is_echo(question) and echo.request.fixed_length != 0):
            return question
        self._nonce = (self._nonce + 1) % 2**32
        return question._replace(payload=self._nonce.to_bytes(_NONCE_BYTES, "big"))
