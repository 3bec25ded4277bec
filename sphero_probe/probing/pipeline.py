"""Send probes as fast as the robot answers, over a link that may drop, and collect their results.

A health check is sent every few probes. If it passes, it confirms the results of all probes before it. If it
fails, those results are void: the robot slept, rebooted or changed its mode, and its answers prove nothing.

A silent probe is sent again until chance no longer explains its silence. After a dropped link, the probes
that were in flight are sent alone, to find the one that drops it. The first wrong length that is accepted
ends wrong-length probing of its node.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.confirmation import Confirmations, Confirmed
from sphero_probe.probing.dropped import DroppedProbes
from sphero_probe.probing.executions import Executions
from sphero_probe.probing.finding import Note
from sphero_probe.probing.health import HealthCheck
from sphero_probe.probing.inflight import Ended
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.recovery import HealthLog, recover, still_healthy
from sphero_probe.probing.retries import (
    DEAD,
    LOST,
    NOT_ITSELF,
    STOPPED,
    SettledProbe,
    SilentProbe,
    no_result,
)
from sphero_probe.probing.scheduler import LOOK_AHEAD, HealthQuestion, Scheduler
from sphero_probe.probing.silent_probes import SilentProbes
from sphero_probe.protocol.packets import Command
from sphero_probe.session.reconnect import Reconnector

if TYPE_CHECKING:
    from sphero_probe.probing.finding import Finding

MAX_VOIDED: Final = 3
"""How often the result of a probe may be void before the probe ends as inconclusive."""


class Pipeline:
    """Sends probes to one robot, and copes with silence, failed health checks and dropped links.

    Attributes:
        line: to the robot.
        health: checks whether the robot is healthy.
        silent: the probes that are silent so far.
        on_answer: called with each answer as it arrives, and with each that becomes void; returns its
            finding.
        executions: learns which wrong lengths were accepted.
        dead: nodes that fail every health check; nothing more is sent to them.
    """

    def __init__(
        self,
        prober: Prober,
        line: Reconnector,
        stop: asyncio.Event,
        executions: Executions,
        on_note: Callable[[Note], None],
    ) -> None:
        self.line = line
        self.health = HealthCheck(prober)
        self.silent = SilentProbes(prober.link.codec, executions, prober.loss)
        self.on_answer: Callable[[SettledProbe], Finding | None] = lambda _: None
        self._on_note = on_note
        self.executions, self._prober = executions, prober
        self._stop = stop
        self._confirmations = Confirmations()
        self._scheduler = Scheduler(prober, self.health, self._confirmations, self._confirm)
        self.dead: set[int | None] = set()
        self._log = HealthLog()
        self._broken: LinkLostError | None = None
        self._dropped = DroppedProbes(line, prober)
        self._voided: Counter[int] = Counter()
        self._settled: list[SettledProbe] = []

    def limit_in_flight(self, width: int | None) -> None:
        """Keep at most this many probes in flight; None for as many as the robot takes."""
        self._scheduler.width = width

    async def feed(self, probes: Iterable[PreparedProbe]) -> list[SettledProbe]:
        """Send probes as fast as the robot answers; return all probes that are settled by then.

        Silent probes stay in ``silent``.
        """
        for probe in probes:
            if probe.blocked:
                self._settled.append(SettledProbe(probe, await self._prober.ask(probe)))
            elif probe.command.target in self.dead:
                self._settled.append(SettledProbe(probe, no_result(probe, 0), DEAD))
            else:
                await self._learn_health(probe.command)
                self._scheduler.todo.append(probe)
        await self._work(lambda: len(self._scheduler.todo) < LOOK_AHEAD)
        return self._take()

    async def finish(self, patience: float = 0.0) -> list[SettledProbe]:
        """Wait until every probe has ended; return those that were not returned yet, silent ones included.

        A late answer may still change the result of a silent probe: see ``wait_for_late``. Silent probes are
        first waited for together, for so many seconds from their first attempt on.
        """
        self._scheduler.is_last = True
        await self._work(self._is_finished)
        self._scheduler.is_last = False
        await self.silent.wait_together(patience, lambda: self._over)
        return self._take() + self.silent.settle_all(self.health, self._why_interrupted())

    async def wait_for_late(self) -> list[SettledProbe]:
        """Wait for late answers to all silent probes; return those that were answered."""
        return await self.silent.wait_for_late(lambda: self._over)

    async def close(self) -> None:
        """Cancel what is in flight."""
        await self._scheduler.in_flight_probes.close()

    @property
    def _over(self) -> bool:
        return self._stop.is_set() or self.line.lost is not None

    def _why_interrupted(self) -> str:
        return LOST if self.line.lost else STOPPED if self._stop.is_set() else ""

    def _take(self) -> list[SettledProbe]:
        taken, self._settled = self._settled, []
        return taken

    async def _learn_health(self, command: Command) -> None:
        """Learn how a node answers a health check, before the first probe is sent to it."""
        target = command.target
        if self.health.knows(target) or not self.health.is_there(command):
            return

        async def learn() -> None:
            await self.health.passes(target)
            self._log.passed(target)

        await self._work(lambda: self._scheduler.is_idle)
        await self.line.with_reconnect(learn)

    async def _work(self, is_done: Callable[[], bool]) -> None:
        """Send and collect until ``is_done`` returns True, or the run is over."""
        in_flight_probes = self._scheduler.in_flight_probes
        while not self._over:
            self._scheduler.send()
            if is_done():
                return
            self._hear(await in_flight_probes.wait_any())
            if self._log or self._broken:
                self._hear(await in_flight_probes.wait_all())
            if self._broken:
                await self._reconnect(self._broken)
            if self._log:
                await self._void()
        self._hear(await in_flight_probes.wait_all())
        for probe in self._dropped.take():
            self.silent.add_lost(probe)
        self._settled += self._confirmations.clear().answered
        self._scheduler.clear()

    def _is_finished(self) -> bool:
        if self._confirmations or not self._scheduler.is_idle:
            return False
        for silent in self.silent:  # more may be known about losses by now
            self._retry(silent)
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

    def _hear_probe(self, probe: PreparedProbe, result: ProbeResult, stamp: int) -> None:
        exchange, pace = result.exchange, self._prober.link.pace(target := probe.command.target)
        if earlier := self.silent.get(probe.number):
            result = ProbeResult(exchange, result.attempts + earlier.attempts)
        self._scheduler.was_silent = isinstance(exchange, Silent)
        if not isinstance(exchange, Silent):
            self.silent.discard(probe.number)
            self.silent.loss.learn(earlier.attempts + 1 if earlier else 1)
            if earlier and earlier.confirmed:
                self.silent.learn_lost(pace, target, [one.seq for one, _ in earlier.sent_at])
            if isinstance(exchange, Answered):
                self.executions.learn(probe, exchange)
                self._prober.learn(probe.command, exchange)
            settled = SettledProbe(probe, result, finding=self.on_answer(SettledProbe(probe, result)))
            self._confirm(self._confirmations.answer(settled, stamp))
            if isinstance(exchange, Answered) and self.health.is_absence(exchange):
                self._confirm(self._confirmations.absent(target, stamp))
            return
        silent = self.silent.add(probe, exchange, result.attempts, pace.crowd(exchange.seq))
        self._confirm(self._confirmations.silence(probe, stamp))
        if self._scheduler.is_last:
            self._retry(silent)  # little else is left to send meanwhile

    def _hear_check(self, question: HealthQuestion, exchange: Exchange) -> None:
        target = question.command.target
        if not self._confirmations.needs(question.check, target):
            return
        is_healthy = self.health.is_healthy(question.command, exchange)
        if is_healthy:
            self.silent.loss.learn(question.attempt)
            self.silent.learn_lost(self._prober.link.pace(target), target, question.lost)
            self._log.passed(target)
            self._confirm(self._confirmations.passed(question.check, target))
        elif is_healthy is None and question.attempt < MAX_ATTEMPTS:
            self._scheduler.questions.append(question.again(exchange))
        else:
            self._log.failed(target, question.check)

    def _confirm(self, confirmed: Confirmed) -> None:
        self._settled += confirmed.answered
        for probe in confirmed.silent:
            if silent := self.silent.get(probe.number):
                silent.confirm(self._prober.link.pace(probe.command.target).overflows)
                self._retry(silent)

    def _retry(self, silent: SilentProbe) -> None:
        """Queue a silent probe to be sent again, unless that would prove nothing or is forbidden."""
        patience = self._prober.link.pace(silent.probe.command.target).patience
        if again := self.silent.next_try(silent, patience):
            self._scheduler.again.append(again)

    async def _void(self) -> None:
        """Send all probes again that no health check confirmed, once their node has recovered.

        The results of other nodes stand if they passed the check that one failed, and pass one now.
        """
        wrong = self._log.take_failed()
        self._scheduler.questions.clear()
        failed, others = min(wrong.values()), self._confirmations.nodes - wrong.keys()
        passed = {target for target in others if self._confirmations.confirmed_to(target) >= failed}
        sound = await still_healthy(self.line, self.health, passed)
        self._log.passed(*sound)
        self._confirm(self._confirmations.clear(sound))
        void = self._confirmations.clear()
        for settled in void.answered:
            probe = settled.probe
            if probe.risk > Risk.WRITE:  # it may have been executed: never repeat it
                self._settled.append(settled._replace(doubt=NOT_ITSELF, finding=None))
            elif self._may_repeat(probe):
                self.on_answer(SettledProbe(probe, no_result(probe, 1), NOT_ITSELF))
                self._scheduler.todo.appendleft(probe)
            else:
                self._settled.append(SettledProbe(probe, no_result(probe, MAX_VOIDED), NOT_ITSELF))
        for probe in void.silent:
            if silent := self.silent.get(probe.number):
                silent.crowds.pop()
                silent.doubt = "" if self._may_repeat(probe) else NOT_ITSELF
                self._retry(silent)
        void_nodes = wrong.keys() | others - sound
        self.give_up_nodes(await recover(self.line, self.health, void_nodes, lambda: self._over))

    def _may_repeat(self, probe: PreparedProbe) -> bool:
        self._voided[probe.number] += 1
        return self._voided[probe.number] < MAX_VOIDED

    def give_up_nodes(self, nodes: set[int | None]) -> None:
        """Settle every probe of nodes that answer nothing."""
        self.dead |= nodes
        for target in nodes:
            self._on_note(self._log.hung(target, self._prober.link.policy.robot))
        for queue in (self._scheduler.todo, self._scheduler.again):
            for probe in [probe for probe in queue if probe.command.target in nodes]:
                queue.remove(probe)
                if probe.number not in self.silent:
                    self._settled.append(SettledProbe(probe, no_result(probe, 0), DEAD))
        for silent in self.silent:
            if silent.probe.command.target in nodes:
                silent.doubt = silent.doubt or DEAD

    async def _reconnect(self, error: LinkLostError) -> None:
        """Reconnect, and send alone the probes that were in flight when the link dropped."""
        self._broken = None
        self._scheduler.questions.clear()
        async for probe, result in self._dropped.ask_again(error):
            if result is None:
                self.silent.add_lost(probe)
            elif isinstance(result, SettledProbe):
                self.silent.discard(probe.number)
                self._settled.append(result)
            else:
                self._hear_probe(probe, result, self._confirmations.checks)
