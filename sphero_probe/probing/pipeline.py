"""Probes in, settled probes out: a robot kept busy, canaries in between, over a line that may drop.

A canary is asked every few probes, in line with them. What was settled before one was sent is proved when it
sings; it is void when the canary is wrong: the robot slept, rebooted or changed its mode, and nothing it said
proves anything. What stays silent is asked again until chance does not explain it. A dropped line is opened
again, and what was in flight is asked alone, so that the probe that drops it twice is known.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Final

from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.roles import Job
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered, Exchange, Late, Refused, Silent
from sphero_probe.link.pacing import LONGEST_TIMEOUT
from sphero_probe.probing.asking import Asked, Asker, Tried
from sphero_probe.probing.canary import Canary
from sphero_probe.probing.flight import ATTEMPTS, Ended
from sphero_probe.probing.line import PAUSES, Line
from sphero_probe.probing.pending import (
    EXECUTED,
    LOST,
    NOT_ITSELF,
    STOPPED,
    SUSPECT,
    Losses,
    Settled,
    Unanswered,
    silence,
    unsent,
)
from sphero_probe.probing.proving import Endings, Proofs
from sphero_probe.probing.sending import Question, Sender

ROUNDS: Final = 3
"""How often a probe may turn out void before it is given up as inconclusive."""
_SLOWER: Final = 1.5
"""What a slow answer may take beyond the slowest so far, as a factor."""


class Pipeline:
    """Asks one robot, whatever happens to it or to the line.

    Attributes:
        line: to the robot.
        canary: tells whether the robot is itself.
        unanswered: number -> what stayed silent so far.
        losses: what the line was seen to lose.
        on_answer: told of each answer as it comes, and of each that turns out void, before the canary's word.
    """

    def __init__(self, asker: Asker, line: Line, stop: asyncio.Event) -> None:
        self.line = line
        self.canary = Canary(asker)
        self.unanswered: dict[int, Unanswered] = {}
        self.losses = Losses()
        self.on_answer: Callable[[Settled], None] = _ignore
        self._asker = asker
        self._stop = stop
        self._proofs = Proofs()
        self._sender = Sender(asker, self.canary, self._proofs, self._prove)
        self._is_wrong = False
        self._broken: LinkLostError | None = None
        self._dropped: list[Asked] = []
        self._drops: Counter[int] = Counter()
        self._voided: Counter[int] = Counter()
        self._settled: list[Settled] = []
        self._slowest = 0.0

    def narrow(self, width: int | None) -> None:
        """Keep no more probes than this in flight; None for as many as the robot bears."""
        self._sender.width = width

    async def feed(self, probes: Iterable[Asked]) -> list[Settled]:
        """Send probes as fast as the robot bears; return what is settled by then, not only of these.

        What stays silent is left in ``unanswered``.
        """
        for asked in probes:
            if asked.barred:
                self._settled.append(Settled(asked, await self._asker.ask(asked)))
            else:
                await self._meet(asked.command.target)
                self._sender.todo.append(asked)
        await self._work(lambda: not self._sender.todo)
        return self._take()

    async def settle(self) -> list[Settled]:
        """Wait until nothing is in flight; return what is settled by then."""
        await self._work(lambda: self._sender.is_idle)
        return self._take()

    async def finish(self) -> list[Settled]:
        """Wait for everything that was fed; return what is not returned yet, silences included."""
        self._sender.is_last = True
        await self._work(self._at_rest)
        self._sender.is_last = False
        await self._wait_for_the_slow()
        words = [one.last_word(self.losses, self._why_open()) for one in self.unanswered.values()]
        self.unanswered.clear()
        return self._take() + words

    async def close(self) -> None:
        """Give up what is in flight."""
        await self._sender.flight.close()

    def hear(self, late: Late) -> None:
        """Take in an answer that came too late; it still settles its own probe."""
        now = asyncio.get_running_loop().time()
        for unanswered in self.unanswered.values():
            self._slowest = max(self._slowest, unanswered.hear(late, now))

    async def _wait_for_the_slow(self) -> None:
        """Give the last silent probes the time that the slowest late answer took, and half of it more."""
        open_ = [at for one in self.unanswered.values() if not one.belated for _, at in one.sent_at]
        if open_ and self._slowest and not self._over:
            until = max(open_) + min(_SLOWER * self._slowest, LONGEST_TIMEOUT)
            await asyncio.sleep(max(0.0, until - asyncio.get_running_loop().time()))

    @property
    def _over(self) -> bool:
        return self._stop.is_set() or self.line.lost is not None

    def _why_open(self) -> str:
        if self.line.lost:
            return LOST
        return STOPPED if self._stop.is_set() else ""

    def _take(self) -> list[Settled]:
        taken, self._settled = self._settled, []
        return taken

    async def _meet(self, target: int | None) -> None:
        """Have the canary learn what a node that was not asked so far answers when it is itself."""
        if self.canary.knows(target):
            return

        async def learn() -> None:
            await self.canary.sings(target)

        await self._work(lambda: self._sender.is_idle)
        await self.line.steady(learn)

    async def _work(self, is_done: Callable[[], bool]) -> None:
        """Keep the robot busy until something is done, or the run is over."""
        flight = self._sender.flight
        while not self._over:
            self._sender.send()
            if is_done():
                return
            self._hear(await flight.some())
            if self._is_wrong or self._broken:
                self._hear(await flight.all())
            if self._broken:
                await self._reconnect(self._broken)
            if self._is_wrong:
                await self._void()
        self._hear(await flight.all())
        for asked in self._dropped:
            self.unanswered[asked.number] = Unanswered(asked, silence(asked), 1, doubt=LOST)
        self._dropped.clear()
        self._settled += self._proofs.clear().answered
        self._sender.clear()

    def _at_rest(self) -> bool:
        if self._proofs or not self._sender.is_idle:
            return False
        for one in self.unanswered.values():  # more may be known of losses by now
            self._call_again(one)
        return self._sender.is_idle

    def _hear(self, ended: Iterable[Ended[Asked | Question, Tried | Exchange]]) -> None:
        for thing, stamp, answer in ended:
            match thing, answer:
                case _, LinkLostError():
                    self._broken = self._broken or answer
                    if isinstance(thing, Asked):
                        self._sender.todo.appendleft(thing) if stamp is None else self._dropped.append(thing)
                case Asked(), Tried():
                    self._hear_probe(thing, answer, stamp or 0)
                case Question(), Answered() | Silent() | Refused():
                    self._hear_canary(thing, answer)

    def _hear_probe(self, asked: Asked, tried: Tried, stamp: int) -> None:
        earlier = self.unanswered.get(asked.number)
        attempts = tried.attempts + (earlier.attempts if earlier else 0)
        if not isinstance(tried.exchange, Silent):
            self.unanswered.pop(asked.number, None)
            self.losses.learn(earlier.attempts + 1 if earlier else 1)
            settled = Settled(asked, tried._replace(attempts=attempts))
            self.on_answer(settled)
            self._prove(self._proofs.answer(settled, stamp))
            return
        one = self.unanswered.setdefault(asked.number, Unanswered(asked, tried.exchange, 0))
        one.silent, one.attempts = tried.exchange, attempts
        one.sent_at.append((tried.exchange, asyncio.get_running_loop().time() - tried.exchange.waited))
        self._prove(self._proofs.silence(asked, stamp))

    def _hear_canary(self, question: Question, exchange: Exchange) -> None:
        if not self._proofs.wants(question.canary):
            return
        right = self.canary.is_right(question.command, exchange)
        if right:
            self.losses.learn(question.attempt)
            self._prove(self._proofs.right(question.canary))
        elif right is None and question.attempt < ATTEMPTS:
            self._sender.questions.append(question._replace(attempt=question.attempt + 1))
        else:
            self._is_wrong = True

    def _prove(self, endings: Endings) -> None:
        self._settled += endings.answered
        for asked in endings.silent:
            if one := self.unanswered.get(asked.number):
                one.proved += 1
                self._call_again(one)

    def _call_again(self, one: Unanswered) -> None:
        """Let a silent probe be asked again, unless its silence is clear or must not be broken."""
        if not (one.belated or one.doubt or one.asked.risk > Risk.WRITE or one.is_final(self.losses)):
            is_last_try = one.proved + 1 >= self.losses.attempts_wanted
            self._sender.again.append(one.asked._replace(is_last_try=is_last_try))

    async def _void(self) -> None:
        """Have everything asked again that no canary proved, once the robot is itself."""
        self._is_wrong = False
        self._sender.questions.clear()
        void = self._proofs.clear()
        for settled in void.answered:
            asked = settled.asked
            if asked.risk > Risk.WRITE:  # executed is executed: it is not repeated
                self._settled.append(settled._replace(doubt=NOT_ITSELF))
            elif self._may_repeat(asked):
                self.on_answer(Settled(asked, unsent(asked, 1), NOT_ITSELF))
                self._sender.todo.appendleft(asked)
            else:
                self._settled.append(Settled(asked, unsent(asked, ROUNDS), NOT_ITSELF))
        for asked in void.silent:
            if one := self.unanswered.get(asked.number):
                one.doubt = "" if self._may_repeat(asked) else NOT_ITSELF
                self._call_again(one)
        await self._recover(self._sender.nodes)

    def _may_repeat(self, asked: Asked) -> bool:
        self._voided[asked.number] += 1
        return self._voided[asked.number] < ROUNDS

    async def _recover(self, nodes: set[int | None]) -> None:
        """Wake the robot and wait until it is itself again, for a while."""
        sang: list[bool] = []

        async def call() -> None:
            for target in nodes:
                await self._asker.do(Job.WAKE, target)
            sang.append(all([await self.canary.sings(target) for target in nodes]))

        for pause in PAUSES:
            await asyncio.sleep(pause)
            await self.line.steady(call)
            if self._over or sang[-1]:
                return

    async def _reconnect(self, error: LinkLostError) -> None:
        """Open the line again, and ask alone what was in flight when it dropped."""
        self._broken, dropped = None, sorted(self._dropped, key=lambda asked: asked.number)
        self._sender.questions.clear()
        self._dropped = []
        self._drops.update(asked.number for asked in dropped)
        await self.line.open_again(error)
        for asked in dropped:
            await self._ask_after_drop(asked)

    async def _ask_after_drop(self, asked: Asked) -> None:
        while not self.line.lost:
            if asked.risk > Risk.WRITE or self._drops[asked.number] > 1:
                doubt = EXECUTED if asked.risk > Risk.WRITE else SUSPECT
                self.unanswered.pop(asked.number, None)
                self._settled.append(Settled(asked, unsent(asked, self._drops[asked.number]), doubt))
                return
            try:
                tried = await self._asker.ask(asked, alone=True)
            except LinkLostError as error:
                self._drops[asked.number] += 1
                await self.line.open_again(error)
            else:
                self._hear_probe(asked, tried, self._proofs.canaries)
                return
        self.unanswered[asked.number] = Unanswered(asked, silence(asked), 1, doubt=LOST)


def _ignore(_: Settled) -> None:
    pass
