"""Ask the questions of calibration until they are answered, and keep them as evidence."""

import asyncio
from collections import defaultdict
from collections.abc import Sequence
from typing import Final, NamedTuple

from sphero_probe.catalogue.well_known import WellKnown
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.probing.profiles import Answer, Step
from sphero_probe.probing.retries import LossEstimate
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.identify import ask_well_known, wake
from sphero_probe.session.reconnect import Reconnector

_PATIENT: Final = 0.5
"""Seconds of timeout beyond which a silence is followed by an echo, whose answer makes the timeout short."""
_TIMES: Final = 4
"""How many round trips such a timeout has at least."""
_SILENCES: Final = 6
"""Silences in a row after which the node is woken and asked echoes, to learn whether it answers at all."""
_ECHOES: Final = 3


class Reply(NamedTuple):
    """How one question ended.

    Attributes:
        verdict: of the answer, None without one.
        answer: the answer, None without one.
        blocked: the policy blocked it.
    """

    verdict: Verdict | None
    answer: Answer | None = None
    blocked: bool = False


class Questions:
    """Asks one node.

    Attributes:
        steps: the evidence so far.
        is_mute: the node answers nothing, not even an echo; it is asked nothing more.
    """

    def __init__(
        self,
        line: Reconnector,
        target: int | None,
        loss: LossEstimate,
        attempts: int = MAX_ATTEMPTS,
        *,
        may_be_mute: bool = False,
        turn: asyncio.Lock | None = None,
    ) -> None:
        """Choose the node and how it is asked.

        Args:
            line: to the robot.
            target: the node's address byte.
            loss: learns how much the link loses.
            attempts: how often a silent question is asked.
            may_be_mute: whether to find out if it answers anything at all.
            turn: of all who ask on this line, so that an echo comes between two silent questions.
        """
        self.steps: list[Step] = []
        self.is_mute = False
        self._may_be_mute = may_be_mute
        self._silences = 0
        self._attempts = attempts
        self._line = line
        self._target = target
        self._loss = loss
        self._echoes = True
        self._silent: defaultdict[Command, list[Silent]] = defaultdict(list)
        self._turn = turn or asyncio.Lock()

    async def ask(self, command: Command, wanted: str) -> Reply:
        """Ask one question.

        Args:
            command: to send; its node is replaced.
            wanted: how a strict node answers.

        Raises:
            LinkLostError: the link was lost.
        """
        step, reply = await self._ask(command, wanted, self._attempts)
        self.steps.append(step)
        return reply

    async def ask_all(
        self, commands: Sequence[Command], *wanted: str, attempts: int | None = None
    ) -> list[Reply]:
        """Ask several questions at once.

        Args:
            commands: to send; their node is replaced.
            *wanted: how a strict node answers each, or one answer for all.
            attempts: how often a silent one is asked, None for the usual number.

        Raises:
            LinkLostError: the link was lost.
        """
        wanted = wanted if len(wanted) == len(commands) else wanted * len(commands)
        limit = self._attempts if attempts is None else attempts
        replies = await ask_together(
            self._ask(command, answer, limit) for command, answer in zip(commands, wanted, strict=True)
        )
        self.steps += [step for step, _ in replies]
        return [reply for _, reply in replies]

    async def _ask(self, command: Command, wanted: str, attempts: int) -> tuple[Step, Reply]:
        """Ask until it is answered; retries are sent with nothing else in flight."""
        codec = self._line.link.codec
        command = command._replace(target=self._target)
        silent = self._silent[command]
        for attempt in range(attempts):
            if self.is_mute:
                break
            exchange = await (self._ask_alone(command) if attempt else self._line.link.ask(command))
            if isinstance(exchange, Blocked):
                return Step(command, wanted, "blocked"), Reply(None, blocked=True)
            self._silences += 1
            if isinstance(exchange, Silent):
                silent.append(exchange)
            if isinstance(exchange, Answered):
                self._silences = 0
                self._loss.learn(len(silent) + 1)
                pace = self._line.link.pace(self._target)
                self._loss.excuse(sum(pace.lost(one.seq) for one in silent))
                silent.clear()
                response = exchange.response
                verdict, said = codec.verdict(response.code), codec.code_name(response.code)
                if verdict is not Verdict.BUSY or wanted == said:
                    return Step(command, wanted, said), Reply(
                        verdict, Answer(response.code, response.payload)
                    )
        return Step(command, wanted, "no answer"), Reply(None)

    async def _ask_alone(self, command: Command) -> Exchange:
        """Ask with nothing else in flight; before another is asked so, an echo may follow a silence."""
        async with self._turn:
            exchange = await self._line.link.ask(command, alone=True)
            if isinstance(exchange, Silent) and not self.is_mute:
                await self._time_an_echo()
                await self._check_mute()
            return exchange

    async def _check_mute(self) -> None:
        """After many silences, wake the node and ask it echoes; a late answer is an answer, too."""
        if self._silences < _SILENCES or not self._may_be_mute:
            return
        self._silences = 0
        link = self._line.link
        await wake(link, self._target, 1)
        before = link.answers
        echo = await ask_well_known(link, WellKnown.ECHO, self._target, _ECHOES)
        self.is_mute = isinstance(echo, Silent) and link.answers == before

    async def _time_an_echo(self) -> None:
        """Make a timeout that silences have made long short again, where the node still answers."""
        link = self._line.link
        pace = link.pace(self._target)
        if self._echoes and pace.round_trip and pace.timeout > max(_PATIENT, _TIMES * pace.round_trip):
            echo = await ask_well_known(link, WellKnown.ECHO, self._target, attempts=1)
            self._echoes = isinstance(echo, Answered)
