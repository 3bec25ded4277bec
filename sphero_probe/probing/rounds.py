"""Probes in, settled probes out: asked in rounds between two canaries, over a line that may drop.

A round is void when the canary behind it fails: the robot slept, rebooted or changed its mode, and nothing it
said proves anything. A dropped line is opened again, and what was in flight is asked alone, so that the probe
that drops it twice is known.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.roles import Job
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered, Silent
from sphero_probe.probing.asking import ATTEMPTS, Asked, Asker, Tried
from sphero_probe.probing.canary import Canary
from sphero_probe.probing.line import PAUSES, Line

ROUND: Final = 16
"""Probes between two canaries."""
ROUNDS: Final = 3
"""How often a round is asked before its probes are given up as inconclusive."""
LOST: Final = "the link was lost before it was settled"
STOPPED: Final = "stopped before it was asked again"
ONCE: Final = "asked once only: its class is not repeated"
NOT_ITSELF: Final = "the robot was asleep, rebooted or in another mode whenever it was asked"
SUSPECT: Final = "suspect: the link dropped twice while this was asked"


class Settled(NamedTuple):
    """How a probe ended.

    Attributes:
        asked: the probe.
        tried: the exchange and how often it was sent.
        doubt: why the exchange proves nothing, empty when it does.
    """

    asked: Asked
    tried: Tried
    doubt: str = ""


@dataclass(slots=True)
class Unanswered:
    """A probe that is waiting to be asked again.

    Attributes:
        asked: the probe.
        silent: its last exchange.
        attempts: how often it was sent.
        belated: the answer that came after all.
        doubt: why it will not be asked again, empty when it will.
    """

    asked: Asked
    silent: Silent
    attempts: int
    belated: Answered | None = None
    doubt: str = ""


class Rounds:
    """Asks one robot, whatever happens to it or to the line.

    Attributes:
        line: to the robot.
        canary: tells whether the robot is itself.
        unanswered: number -> what stayed silent so far.
        on_answer: told of each answer as it comes, and of each that turns out void, before the canary's word.
    """

    def __init__(self, asker: Asker, line: Line, stop: asyncio.Event) -> None:
        self.on_answer: Callable[[Settled], None] = _ignore
        self.line = line
        self.canary = Canary(asker)
        self.unanswered: dict[int, Unanswered] = {}
        self._asker = asker
        self._stop = stop
        self._drops: Counter[int] = Counter()

    async def ask(self, chunk: Sequence[Asked]) -> list[Settled]:
        """Ask one round; what stays silent is left in ``unanswered``."""
        settled = [Settled(asked, await self._asker.ask(asked)) for asked in chunk if asked.barred]
        chunk = [asked for asked in chunk if not asked.barred]
        for _ in range(ROUNDS):
            heard = await self._send(chunk)
            if self._stop.is_set() or self.line.lost or await self._itself(chunk):
                return settled + heard
            await self._recover(chunk)
            # executed is executed: what may not be repeated keeps its answer, with the doubt
            settled += [one._replace(doubt=NOT_ITSELF) for one in heard if one.asked.risk > Risk.WRITE]
            done = {one.asked.number for one in settled}
            chunk = [asked for asked in chunk if asked.number not in done]
            for asked in chunk:
                if asked.risk <= Risk.WRITE:
                    self.unanswered.pop(asked.number, None)
            chunk = [asked for asked in chunk if asked.risk <= Risk.WRITE]
            for asked in chunk:
                self.on_answer(Settled(asked, _unsent(asked, 1), NOT_ITSELF))
        return settled + [Settled(asked, _unsent(asked, ROUNDS), NOT_ITSELF) for asked in chunk]

    async def ask_again(self) -> list[Settled]:
        """Ask what was silent once more, alone: too wide a window invents silence."""
        settled: list[Settled] = []
        asked_now: list[Asked] = []
        for number, unanswered in sorted(self.unanswered.items()):
            if self._stop.is_set() or self.line.lost:
                break
            if unanswered.belated or unanswered.doubt or unanswered.asked.risk > Risk.WRITE:
                continue
            if unanswered.attempts >= ATTEMPTS:
                continue
            asked_now.append(unanswered.asked)
            heard = await self._alone(unanswered.asked)
            if heard is None:
                continue
            if isinstance(heard.tried.exchange, Silent) and not heard.doubt:
                unanswered.silent = heard.tried.exchange
                unanswered.attempts += heard.tried.attempts
            else:
                del self.unanswered[number]
                attempts = unanswered.attempts + heard.tried.attempts
                settled.append(heard._replace(tried=heard.tried._replace(attempts=attempts)))
        if asked_now and not self._stop.is_set() and not self.line.lost and not await self._itself(asked_now):
            await self._recover(asked_now)
            for asked in asked_now:
                if asked.number in self.unanswered:
                    self.unanswered[asked.number].attempts -= 1
        return settled

    def last_words(self) -> list[Settled]:
        """Return, and forget, what stayed without an answer in time."""
        settled: list[Settled] = []
        for unanswered in self.unanswered.values():
            asked, attempts = unanswered.asked, unanswered.attempts
            doubt = unanswered.doubt
            if not doubt and attempts < ATTEMPTS:
                doubt = NOT_ITSELF
                if self.line.lost:
                    doubt = LOST
                elif self._stop.is_set():
                    doubt = STOPPED
                elif asked.risk > Risk.WRITE:
                    doubt = ONCE
            if unanswered.belated:
                settled.append(Settled(asked, Tried(unanswered.belated, attempts)))
            else:
                settled.append(Settled(asked, Tried(unanswered.silent, attempts), doubt))
        self.unanswered.clear()
        return settled

    async def _send(self, chunk: Sequence[Asked]) -> list[Settled]:
        """Ask a round with several in flight; after a drop, what was in flight goes alone."""
        settled: list[Settled] = []
        todo = list(chunk)
        while todo and not self.line.lost and not self._stop.is_set():
            heard, in_flight, error = await self._window(todo)
            settled += heard
            done = {one.asked.number for one in heard} | set(self.unanswered)
            todo = [asked for asked in todo if asked.number not in done]
            if error is None:
                break
            for asked in in_flight:
                self._drops[asked.number] += 1
            await self.line.open_again(error)
            for asked in in_flight:
                if self.line.lost:
                    self.unanswered[asked.number] = Unanswered(asked, _silence(asked), 1, doubt=LOST)
                elif one := await self._after_drop(asked):
                    settled.append(one)
            done = {one.asked.number for one in settled} | set(self.unanswered)
            todo = [asked for asked in todo if asked.number not in done]
        return settled

    async def _window(
        self, chunk: Sequence[Asked]
    ) -> tuple[list[Settled], list[Asked], LinkLostError | None]:
        """Keep as many in flight as the link's window holds, until all are heard of or the line drops."""
        running: dict[asyncio.Task[Tried], Asked] = {}
        settled: list[Settled] = []
        dropped: list[Asked] = []
        error: LinkLostError | None = None
        waiting = list(chunk)
        try:
            while running or (waiting and not error and not self._stop.is_set()):
                while waiting and len(running) < self._asker.link.window and not error:
                    if self._stop.is_set():
                        break
                    asked = waiting.pop(0)
                    running[asyncio.create_task(self._asker.ask(asked))] = asked
                done, _ = await asyncio.wait(running, return_when=asyncio.FIRST_COMPLETED)
                for task in sorted(done, key=lambda task: running[task].number):
                    asked = running.pop(task)
                    try:
                        tried = task.result()
                    except LinkLostError as lost:
                        error = error or lost
                        dropped.append(asked)
                        continue
                    if isinstance(tried.exchange, Silent):
                        self.unanswered[asked.number] = Unanswered(asked, tried.exchange, tried.attempts)
                    else:
                        settled.append(Settled(asked, tried))
                        self.on_answer(settled[-1])
        finally:
            for task in running:
                task.cancel()
            await asyncio.gather(*running, return_exceptions=True)
        return settled, dropped, error

    async def _after_drop(self, asked: Asked) -> Settled | None:
        """Ask again, alone, what was in flight when the line dropped; None where it stayed silent."""
        if asked.risk > Risk.WRITE:
            return Settled(asked, _unsent(asked, 1), "the link dropped: it may have been executed")
        if self._drops[asked.number] > 1:
            return Settled(asked, _unsent(asked, self._drops[asked.number]), SUSPECT)
        heard = await self._alone(asked)
        if heard is None:
            return None
        if isinstance(heard.tried.exchange, Silent) and not heard.doubt:
            self.unanswered[asked.number] = Unanswered(asked, heard.tried.exchange, 1)
            return None
        return heard

    async def _alone(self, asked: Asked) -> Settled | None:
        """Ask with nothing else in flight; a line that drops under it makes it a suspect."""
        try:
            return Settled(asked, await self._asker.ask(asked, alone=True))
        except LinkLostError as error:
            self._drops[asked.number] += 1
            await self.line.open_again(error)
        if self.line.lost:
            self.unanswered[asked.number] = Unanswered(asked, _silence(asked), 1, doubt=LOST)
            return None
        if self._drops[asked.number] > 1:
            return Settled(asked, _unsent(asked, self._drops[asked.number]), SUSPECT)
        return await self._alone(asked)

    async def _itself(self, chunk: Sequence[Asked]) -> bool:
        """Whether the canary sings on every node of a round."""
        try:
            for target in {asked.command.target for asked in chunk}:
                if not await self.canary.sings(target):
                    return False
        except LinkLostError as error:
            await self.line.open_again(error)
            return False
        return True

    async def _recover(self, chunk: Sequence[Asked]) -> None:
        """Wake the robot and wait until it is itself again, for a while."""
        for pause in PAUSES:
            if self._stop.is_set() or self.line.lost:
                return
            await asyncio.sleep(pause)
            try:
                for target in {asked.command.target for asked in chunk}:
                    await self._asker.do(Job.WAKE, target)
            except LinkLostError as error:
                await self.line.open_again(error)
            if await self._itself(chunk):
                return


def _ignore(_: Settled) -> None:
    pass


def _silence(asked: Asked) -> Silent:
    return Silent(asked.command, 0, b"", 0.0)


def _unsent(asked: Asked, attempts: int) -> Tried:
    return Tried(_silence(asked), attempts)
