"""Whether the robot is still itself: a node in, yes or no out.

A robot that fell asleep, rebooted or changed its mode answers everything with silence or with something else.
So between two rounds of probes it is asked two things whose answers are known: an echo, and a command that it
called absent. What it said since they were last right is void when they are wrong.
"""

from typing import Final

from sphero_probe.catalogue.roles import Job, row_for
from sphero_probe.link.exchange import Answered, Silent
from sphero_probe.link.guard import WRONG_LENGTH
from sphero_probe.probing.asking import ATTEMPTS, Asker
from sphero_probe.probing.calibration import GONE
from sphero_probe.protocol.packets import Command, Verdict

_NONCE_BYTES: Final = 4


class Canary:
    """Knows per node which of the two questions a healthy robot answers, and asks them."""

    def __init__(self, asker: Asker) -> None:
        self._asker = asker
        self._questions: dict[int | None, list[Command]] = {}
        self._nonce = 0

    async def sings(self, target: int | None) -> bool:
        """Ask and compare; the first time only takes in what this node answers rightly.

        Raises:
            LinkLostError: the robot is gone.
        """
        if target not in self._questions:
            candidates = self._candidates(target)
            self._questions[target] = [question for question in candidates if await self._right(question)]
            return True
        for question in self._questions[target]:
            if not await self._right(question):
                return False
        return True

    def _candidates(self, target: int | None) -> list[Command]:
        questions: list[Command] = []
        echo = row_for(self._asker.link.codec.generation, Job.ECHO)
        if echo and self._asker.link.guard.why_not(Command(echo.did, echo.cid, b"", target)) is None:
            questions.append(Command(echo.did, echo.cid, b"", target))
        profile = self._asker.profiles.get(target)
        if profile and profile.absent:
            questions.append(profile.absent._replace(payload=bytes(WRONG_LENGTH)))
        return questions

    async def _right(self, question: Command) -> bool:
        codec = self._asker.link.codec
        echo = row_for(codec.generation, Job.ECHO)
        is_echo = echo is not None and question[:2] == (echo.did, echo.cid)
        if is_echo and echo and echo.request and echo.request.fixed_length != 0:
            self._nonce = (self._nonce + 1) % 2**32
            question = question._replace(payload=self._nonce.to_bytes(_NONCE_BYTES, "big"))
        for _ in range(ATTEMPTS):
            exchange = await self._asker.link.ask(question, alone=True)
            if isinstance(exchange, Answered):
                verdict = codec.verdict(exchange.response.code)
                if verdict is Verdict.BUSY:
                    continue
                if is_echo:
                    return verdict is Verdict.OK and exchange.response.payload == question.payload
                return verdict in GONE
            if not isinstance(exchange, Silent):
                return True
        return False
