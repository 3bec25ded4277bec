"""Questions of calibration: each is asked until it is answered, and kept as evidence."""

from collections.abc import Sequence
from typing import NamedTuple

from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.exchange import Answered, Blocked
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.probing.profiles import Answer, Step
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.reconnect import Reconnector


class Reply(NamedTuple):
    """How one question ended.

    Attributes:
        verdict: of the answer, None without one.
        answer: the answer, None without one.
        blocked: the policy did not let it out.
    """

    verdict: Verdict | None
    answer: Answer | None = None
    blocked: bool = False


class Questions:
    """Asks one node.

    Attributes:
        steps: the evidence so far.
    """

    def __init__(self, line: Reconnector, target: int | None, attempts: int = MAX_ATTEMPTS) -> None:
        """Take the node, and how often a silent question is asked."""
        self.steps: list[Step] = []
        self._attempts = attempts
        self._line = line
        self._target = target

    async def ask(self, command: Command, wanted: str) -> Reply:
        """Ask one question.

        Args:
            command: what to ask, of any node.
            wanted: what a strict node answers.

        Raises:
            LinkLostError: the robot is gone.
        """
        (reply,) = await self.ask_all([command], wanted)
        return reply

    async def ask_all(self, commands: Sequence[Command], *wanted: str) -> list[Reply]:
        """Ask several questions at once; what is wanted is told for each, or once for all.

        Raises:
            LinkLostError: the robot is gone.
        """
        wanted = wanted if len(wanted) == len(commands) else wanted * len(commands)
        asked = await ask_together(map(self._ask, commands, wanted))
        self.steps += [step for step, _ in asked]
        return [reply for _, reply in asked]

    async def _ask(self, command: Command, wanted: str) -> tuple[Step, Reply]:
        """Ask until it is answered; from the second time on with nothing else in flight."""
        codec = self._line.link.codec
        command = command._replace(target=self._target)
        for attempt in range(self._attempts):
            exchange = await self._line.link.ask(command, alone=attempt > 0)
            if isinstance(exchange, Blocked):
                return Step(command, wanted, "blocked"), Reply(None, blocked=True)
            if isinstance(exchange, Answered):
                response = exchange.response
                verdict, said = codec.verdict(response.code), codec.code_name(response.code)
                if verdict is not Verdict.BUSY or wanted == said:
                    return Step(command, wanted, said), Reply(
                        verdict, Answer(response.code, response.payload)
                    )
        return Step(command, wanted, "no answer"), Reply(None)
