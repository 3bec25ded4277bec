"""Keeping a robot busy: probes are sent as fast as it answers, over a link that may drop.

A health check is sent every few probes. What was settled before it was sent is confirmed when it passes, and
void when it fails: the robot slept, rebooted or changed its mode, and nothing it said proves anything.

A silent probe is sent again until chance does not explain its silence. After a dropped link, what was in
flight is sent alone, so that the probe which drops it twice is known. An answer that shows that a wrong
length was accepted ends wrong-length probing of its node at once.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered, Blocked, Exchange, LateResponse, Silent
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.confirmation import Confirmations, Confirmed
from sphero_probe.probing.dropped import DroppedProbes
from sphero_probe.probing.executions import Executions
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.inflight import Ended
from sphero_probe.probing.late_answers import SLOWEST, LateAnswers
from sphero_probe.probing.near_misses import NearMisses
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.recovery import recover
from sphero_probe.probing.retries import (
    DEAD,
    LOST,
    NOT_ITSELF,
    STOPPED,
    UNCHECKED,
    LossEstimate,
    SettledProbe,
    SilentProbe,
    no_result,
    silence,
)
from sphero_probe.probing.scheduler import HealthQuestion, Scheduler
from sphero_probe.protocol.packets import Malformed
from sphero_probe.session.reconnect import Reconnector

if TYPE_CHECKING:
    from sphero_probe.probing.finding import Finding

ROUNDS: Final = 3
"""How often a probe may turn out void before it is given up as inconclusive."""


class Pipeline:
    """Asks one robot, whatever happens to it or to the line.

    Attributes:
        line: to the robot.
        health: tells whether the robot is itself.
        unanswered: number -> what stayed silent so far.
        loss: what the line was seen to lose.
        on_answer: judges each answer as it comes, and each that turns out void.
        executions: learns which wrong lengths were accepted.
        dead: nodes that fail every health check; nothing more is sent to them.
    """

    def __init__(
        self, prober: Prober, line: Reconnector, stop: asyncio.Event, executions: Executions
    ) -> None:
        self.line = line
        self.health = HealthCheck(prober)
        self.unanswered: dict[int, SilentProbe] = {}
        self.loss = LossEstimate()
        self.on_answer: Callable[[SettledProbe], Finding | None] = _ignore
        self.executions = executions
        self._prober = prober
        self._stop = stop
        self._confirmations = Confirmations()
        self._scheduler = Scheduler(prober, self.health, self._confirmations, self._confirm)
        self.dead: set[int | None] = set()
        self._wrong: set[int | None] = set()
        self._broken: LinkLostError | None = None
        self._dropped = DroppedProbes(line, prober)
        self._voided: Counter[int] = Counter()
        self._settled: list[SettledProbe] = []
        self._near_misses = NearMisses(prober.link.codec)
        self._late = LateAnswers()

    def limit_in_flight(self, width: int | None) -> None:
        """Keep no more probes than this in flight; None for as many as the robot takes."""
        self._scheduler.width = width

    async def feed(self, probes: Iterable[PreparedProbe]) -> list[SettledProbe]:
        """Send probes as fast as the robot answers; return what is settled by then, not only of these.

        What stays silent is left in ``unanswered``.
        """
        for asked in probes:
            if asked.blocked:
                self._settled.append(SettledProbe(asked, await self._prober.ask(asked)))
            elif asked.command.target in self.dead:
                self._settled.append(SettledProbe(asked, no_result(asked, 0), DEAD))
            else:
                await self._learn_health(asked.command.target)
                self._scheduler.todo.append(asked)
        await self._work(lambda: not self._scheduler.todo)
        return self._take()

    async def finish(self) -> list[SettledProbe]:
        """Wait for everything that was fed; return what is not returned yet, silences included.

        A late answer may still change what a silent probe proves: see ``wait_for_late``.
        """
        self._scheduler.is_last = True
        await self._work(self._at_rest)
        self._scheduler.is_last = False
        words: list[SettledProbe] = []
        for one in self.unanswered.values():
            if not self.health.has_questions(one.asked.command.target):
                one.doubt = one.doubt or UNCHECKED
            damage = self._near_misses.of(one.sent_at)
            words.append(one.last_word(self.loss, self._why_open(), damage))
            if not one.late_answer:
                self._late.watch(one)
        self.unanswered.clear()
        return self._take() + words

    async def wait_for_late(self, patience: float = SLOWEST) -> list[SettledProbe]:
        """Wait for late answers to all probes that stayed silent; return those that were answered after all.

        Args:
            patience: seconds, from the first attempt of each probe on.
        """
        answered = await self._late.wait(lambda: self._over, patience)
        await self.executions.report()
        return [one.last_word(self.loss, "") for one in answered]

    async def close(self) -> None:
        """Give up what is in flight."""
        await self._scheduler.in_flight_probes.close()

    def hear(self, unsolicited: Malformed | LateResponse) -> None:
        """Take in a late answer, which still settles its own probe, or bytes that fit no command."""
        self._near_misses.hear(unsolicited, now=asyncio.get_running_loop().time())
        if isinstance(unsolicited, LateResponse):
            unanswered = (one for one in self.unanswered.values() if one.hear(unsolicited))
            one = next(unanswered, None) or self._late.hear(unsolicited)
            if one and one.late_answer:
                self.executions.look(one.asked, one.late_answer)

    @property
    def _over(self) -> bool:
        return self._stop.is_set() or self.line.lost is not None

    def _why_open(self) -> str:
        return LOST if self.line.lost else STOPPED if self._stop.is_set() else ""

    def _take(self) -> list[SettledProbe]:
        taken, self._settled = self._settled, []
        return taken

    async def _learn_health(self, target: int | None) -> None:
        """Have the canary learn what a node that was not asked so far answers when it is itself."""
        if self.health.knows(target):
            return

        async def learn() -> None:
            await self.health.passes(target)

        await self._work(lambda: self._scheduler.is_idle)
        await self.line.with_reconnect(learn)

    async def _work(self, is_done: Callable[[], bool]) -> None:
        """Keep the robot busy until something is done, or the run is over."""
        in_flight_probes = self._scheduler.in_flight_probes
        while not self._over:
            self._scheduler.send()
            if is_done():
                return
            self._hear(await in_flight_probes.some())
            if self._wrong or self._broken:
                self._hear(await in_flight_probes.all())
            if self._broken:
                await self._reconnect(self._broken)
            if self._wrong:
                await self._void()
        self._hear(await in_flight_probes.all())
        for asked in self._dropped.take():
            self.unanswered[asked.number] = SilentProbe(asked, silence(asked), 1, doubt=LOST)
        self._settled += self._confirmations.clear().answered
        self._scheduler.clear()

    def _at_rest(self) -> bool:
        if self._confirmations or not self._scheduler.is_idle:
            return False
        for one in self.unanswered.values():  # more may be known of losses by now
            self._call_again(one)
        return self._scheduler.is_idle

    def _hear(self, ended: Iterable[Ended[PreparedProbe | HealthQuestion, ProbeResult | Exchange]]) -> None:
        for item, stamp, answer in ended:
            match item, answer:
                case _, LinkLostError():
                    self._broken = self._broken or answer
                    if isinstance(item, PreparedProbe):
                        self._scheduler.todo.appendleft(item) if stamp is None else self._dropped.add(item)
                case PreparedProbe(), ProbeResult():
                    self._hear_probe(item, answer, stamp or 0)
                case HealthQuestion(), Answered() | Silent() | Blocked():
                    self._hear_check(item, answer)

    def _hear_probe(self, asked: PreparedProbe, tried: ProbeResult, stamp: int) -> None:
        earlier = self.unanswered.get(asked.number)
        attempts = tried.attempts + (earlier.attempts if earlier else 0)
        if not isinstance(tried.exchange, Silent):
            self.unanswered.pop(asked.number, None)
            self.loss.learn(earlier.attempts + 1 if earlier else 1)
            if isinstance(tried.exchange, Answered):
                self.executions.look(asked, tried.exchange)
                self._prober.learn(asked.command, tried.exchange)
            settled = SettledProbe(asked, tried._replace(attempts=attempts))
            settled = settled._replace(finding=self.on_answer(settled))
            self._confirm(self._confirmations.answer(settled, stamp))
            return
        one = self.unanswered.setdefault(asked.number, SilentProbe(asked, tried.exchange, 0))
        one.silent, one.attempts = tried.exchange, attempts
        one.sent_at.append((tried.exchange, asyncio.get_running_loop().time() - tried.exchange.waited))
        self._confirm(self._confirmations.silence(asked, stamp))

    def _hear_check(self, question: HealthQuestion, exchange: Exchange) -> None:
        if not self._confirmations.wants(question.health):
            return
        right = self.health.is_healthy(question.command, exchange)
        if right:
            self.loss.learn(question.attempt)
            self._confirm(self._confirmations.right(question.health))
        elif right is None and question.attempt < MAX_ATTEMPTS:
            self._scheduler.questions.append(question._replace(attempt=question.attempt + 1))
        else:
            self._wrong.add(question.command.target)

    def _confirm(self, endings: Confirmed) -> None:
        self._settled += endings.answered
        for asked in endings.silent:
            if one := self.unanswered.get(asked.number):
                one.confirmed += 1
                self._call_again(one)

    def _call_again(self, one: SilentProbe) -> None:
        """Let a silent probe be asked again, unless its silence is clear or must not be broken."""
        if not (one.late_answer or one.doubt or one.asked.risk > Risk.WRITE or one.is_final(self.loss)):
            is_last_try = one.confirmed + 1 >= self.loss.attempts_wanted
            self._scheduler.again.append(one.asked._replace(is_last_try=is_last_try))

    async def _void(self) -> None:
        """Have everything asked again that no health check confirmed, once the robot is itself."""
        wrong, self._wrong = self._wrong, set()
        self._scheduler.questions.clear()
        void = self._confirmations.clear()
        for settled in void.answered:
            asked = settled.asked
            if asked.risk > Risk.WRITE:  # executed is executed: it is not repeated
                self._settled.append(settled._replace(doubt=NOT_ITSELF, finding=None))
            elif self._may_repeat(asked):
                self.on_answer(SettledProbe(asked, no_result(asked, 1), NOT_ITSELF))
                self._scheduler.todo.appendleft(asked)
            else:
                self._settled.append(SettledProbe(asked, no_result(asked, ROUNDS), NOT_ITSELF))
        for asked in void.silent:
            if one := self.unanswered.get(asked.number):
                one.doubt = "" if self._may_repeat(asked) else NOT_ITSELF
                self._call_again(one)
        self._bury(await recover(self.line, self.health, wrong, lambda: self._over))

    def _may_repeat(self, asked: PreparedProbe) -> bool:
        self._voided[asked.number] += 1
        return self._voided[asked.number] < ROUNDS

    def _bury(self, nodes: set[int | None]) -> None:
        """Settle every probe of dead nodes: nothing can be told of them any more."""
        self.dead |= nodes
        for queue in (self._scheduler.todo, self._scheduler.again):
            for asked in [asked for asked in queue if asked.command.target in nodes]:
                queue.remove(asked)
                if asked.number not in self.unanswered:
                    self._settled.append(SettledProbe(asked, no_result(asked, 0), DEAD))
        for one in self.unanswered.values():
            if one.asked.command.target in nodes:
                one.doubt = one.doubt or DEAD

    async def _reconnect(self, error: LinkLostError) -> None:
        """Open the link again, and send alone what was in flight when it dropped."""
        self._broken = None
        self._scheduler.questions.clear()
        async for probe, result in self._dropped.ask_again(error):
            if result is None:
                self.unanswered[probe.number] = SilentProbe(probe, silence(probe), 1, doubt=LOST)
            elif isinstance(result, SettledProbe):
                self.unanswered.pop(probe.number, None)
                self._settled.append(result)
            else:
                self._hear_probe(probe, result, self._confirmations.checks)


def _ignore(_: SettledProbe) -> None:
    return None
