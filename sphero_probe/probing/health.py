"""Check that a node still answers as it did at the start.

A robot that fell asleep, rebooted or changed its mode is silent or answers differently. So it is asked two
questions between probes whose answers are known: an echo, and a command that it called absent. If an answer
is wrong, all answers since the last passed check are void.
"""

from typing import Final

from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.link.wrong_lengths import WRONG_PAYLOAD
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.profiles import GONE
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command, Verdict

_NONCE_BYTES: Final = 4


class HealthCheck:
    """Knows for each node which of the two questions it answers, and asks them."""

    def __init__(self, prober: Prober) -> None:
        self._prober = prober
        self._questions: dict[int | None, list[Command]] = {}
        self._nonce = 0

    def knows(self, target: int | None) -> bool:
        """Whether the questions of this node are known."""
        return target in self._questions

    def has_questions(self, target: int | None) -> bool:
        """Whether a health check of this node can pass or fail."""
        return bool(self._questions.get(target))

    def questions(self, target: int | None) -> list[Command]:
        """Return the questions for this node, the echo with a new nonce."""
        return [self._with_nonce(question) for question in self._questions.get(target, ())]

    def is_healthy(self, question: Command, exchange: Exchange) -> bool | None:
        """Whether an answer is that of a healthy robot; None if the answer does not tell."""
        codec = self._prober.link.codec
        match exchange:
            case Answered(response=response):
                verdict = codec.verdict(response.code)
                if verdict is Verdict.BUSY:
                    return None
                if self.is_echo(question):
                    return verdict is Verdict.OK and response.payload == question.payload
                return verdict in GONE
            case Silent():
                return None
            case Blocked():  # a changed policy says nothing about the robot
                return True

    def is_absence(self, answer: Answered) -> bool:
        """Whether an answer says that there is no such command, as a healthy robot says of an absent one."""
        return self._prober.link.codec.verdict(answer.response.code) in GONE

    async def passes(self, target: int | None, attempts: int = MAX_ATTEMPTS) -> bool:
        """Ask the questions alone and compare; the first call only learns which ones this node answers.

        Raises:
            LinkLostError: the link was lost.
        """
        if not self.knows(target):
            echoes, absent = self._candidates(target)
            passed = await ask_together(self._passes(one, attempts, together=True) for one in echoes)
            self._questions[target] = [one for one, right in zip(echoes, passed, strict=True) if right]
            self._questions[target] += absent
            return True
        for question in self._questions[target]:
            if not await self._passes(question, attempts):
                return False
        return True

    def _candidates(self, target: int | None) -> tuple[list[Command], list[Command]]:
        """Return the echo, if it may be sent, and a command that calibration saw the node call absent."""
        echo = row_for(self._prober.link.codec.generation, WellKnown.ECHO)
        profile = self._prober.profiles.get(target)
        echoes = [Command(echo.did, echo.cid, b"", target)] if echo else []
        absent = [profile.absent._replace(payload=WRONG_PAYLOAD)] if profile and profile.absent else []
        return [one for one in echoes if self._prober.link.policy.why_blocked(one) is None], absent

    async def _passes(self, question: Command, attempts: int, *, together: bool = False) -> bool:
        """Ask until something can be told.

        Args:
            question: to ask.
            attempts: how often.
            together: lets others be in flight at the first attempt; what is lost then tells of a full queue.
        """
        question = self._with_nonce(question)
        pace, lost = self._prober.link.pace(question.target), list[int]()
        for attempt in range(attempts):
            alone = attempt > 0 or not together
            exchange = await self._prober.link.ask(question, alone=alone)
            healthy = self.is_healthy(question, exchange)
            if healthy is not None:
                if together:
                    self._prober.loss.learn(len(lost) + 1)
                    self._prober.loss.excuse(sum(pace.lost(seq) for seq in lost))
                return healthy
            lost += [exchange.seq] if isinstance(exchange, Silent) else []
        return False

    def is_there(self, command: Command) -> bool:
        """Whether a node is known to be there: the model has it, or more than an echo is sent to it."""
        robot, target = self._prober.link.policy.robot, command.target
        if robot is None or target is None or not self.is_echo(command):
            return True
        return Address.from_byte(target).node in robot.nodes

    def is_echo(self, question: Command) -> bool:
        """Whether a command is the echo that a check asks."""
        echo = row_for(self._prober.link.codec.generation, WellKnown.ECHO)
        return echo is not None and question[:2] == (echo.did, echo.cid)

    def _with_nonce(self, question: Command) -> Command:
        """Fill an echo that takes bytes with a new nonce."""
        echo = row_for(self._prober.link.codec.generation, WellKnown.ECHO)
        if not (echo and echo.request and self.is_echo(question) and echo.request.fixed_length != 0):
            return question
        self._nonce = (self._nonce + 1) % 2**32
        return question._replace(payload=self._nonce.to_bytes(_NONCE_BYTES, "big"))
