"""One probe at a time: a probe in, made ready by catalogue and calibration; how asking it ended out."""

import asyncio
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, Blocked, Exchange
from sphero_probe.link.link import Link
from sphero_probe.link.policy import WRONG_LENGTH, Consent
from sphero_probe.probing.calibration import Calibration, Profile, Strictness
from sphero_probe.probing.plan import Probe
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.identify import wake
from sphero_probe.session.reconnect import Reconnector

BUSY_ATTEMPTS: Final = 5
BUSY_PAUSE: Final = 0.1
"""Seconds before a busy robot is asked again; doubled each time."""


class PreparedProbe(NamedTuple):
    """A probe made ready.

    Attributes:
        number: its place in the run, from 1.
        command: with node and payload filled in.
        risk: the class of sending it.
        knowledge: the catalogue's row for this robot, None where there is none.
        blocked: why it must not be sent, empty when it may.
        is_last_try: it gets the whole timeout, whatever is answered meanwhile.
    """

    number: int
    command: Command
    risk: Risk
    knowledge: CommandRow | None
    blocked: str
    is_last_try: bool = False

    @property
    def is_expected(self) -> bool:
        """Whether an answer is sure to come: it is a documented query."""
        return self.knowledge is not None and self.knowledge.risk is Risk.READ and self.risk is Risk.READ


class ProbeResult(NamedTuple):
    """How asking a probe ended, and how often it went out for that."""

    exchange: Exchange
    attempts: int


def _forget(_: PreparedProbe) -> None:
    pass


class Prober:
    """Asks one robot over one link.

    Attributes:
        profiles: node -> what calibration measured on it.
        intend: told of each probe before it goes out, each time it does.
        line: to the robot.
        target: the address byte of the robot's usual node.
    """

    def __init__(self, line: Reconnector, target: int | None) -> None:
        self.profiles: dict[int | None, Profile] = {}
        self.intend: Callable[[PreparedProbe], None] = _forget
        self.line = line
        self.target = target

    @property
    def link(self) -> Link:
        """The open link; another one after a reconnect."""
        return self.line.link

    def masks(self, target: int | None) -> bool:
        """Whether this node may refuse lengths even where no command exists: only a strict one does not."""
        profile = self.profiles.get(target)
        return profile is None or profile.strictness is not Strictness.STRICT

    def must_measure(self, probe: Probe) -> bool:
        """Whether ``prepare`` will calibrate the probe's node first."""
        return self._needs_profile(self._complete(probe)[0])

    async def prepare(self, number: int, probe: Probe) -> tuple[PreparedProbe, Profile | None]:
        """Fill in node and payload; calibrate the node first when the probe needs that.

        Returns:
            The probe, and the profile if one was measured just now.

        Raises:
            LinkLostError: the robot is gone.
        """
        command, _ = self._complete(probe)
        measured = None
        if self._needs_profile(command):
            measured = await Calibration(self.link, command.target).measure()
            self.profiles[command.target] = measured
        return self.complete(number, probe), measured

    def complete(self, number: int, probe: Probe) -> PreparedProbe:
        """Fill in node and payload, and judge the probe by what is known so far."""
        policy = self.link.policy
        command, row = self._complete(probe)
        blocked = policy.why_blocked(command) or ""
        if len(command.payload) > self.link.codec.max_payload:
            blocked = f"a payload of {len(command.payload)} bytes fits no frame of this robot"
        return PreparedProbe(number, command, policy.assess(command).risk, row, blocked)

    async def calibrate_for(self, probes: Iterable[Probe]) -> list[Profile]:
        """Measure every node that one of these probes needs measured; return the profiles.

        Raises:
            LinkLostError: the robot is gone.
        """
        measured: list[Profile] = []
        for probe in probes:
            command, _ = self._complete(probe)
            if self._needs_profile(command):
                self.profiles[command.target] = await Calibration(self.link, command.target).measure()
                measured.append(self.profiles[command.target])
        return measured

    def _complete(self, probe: Probe) -> tuple[Command, CommandRow | None]:
        """Fill in node and payload; return the command and what is known of it."""
        policy = self.link.policy
        command = probe.command
        if command.target is None:
            command = command._replace(target=self.target)
        row = lookup(self.link.codec.generation, command.did, command.cid, policy.robot)
        if not probe.exact and not command.payload:
            command = command._replace(payload=payload_for(row, policy.consent))
        return command, row

    def _needs_profile(self, command: Command) -> bool:
        """Whether how this node treats lengths matters for the command, and is not yet known."""
        policy = self.link.policy
        by_length = policy.assess(command).risk is Risk.PROBE or policy.hinges_on_length_check(command)
        return by_length and command.target not in self.profiles

    async def ask(
        self, asked: PreparedProbe, before_sending: Callable[[], None] | None = None, *, alone: bool = False
    ) -> ProbeResult:
        """Ask one probe; a busy robot is asked again after a pause, a sleeping node is woken once.

        Args:
            asked: the probe.
            before_sending: called each time it is about to go out.
            alone: with nothing else in flight.

        Raises:
            LinkLostError: the robot is gone.
        """
        if asked.blocked:
            return ProbeResult(Blocked(asked.command, asked.risk, asked.blocked), 0)
        woken = False
        pause = BUSY_PAUSE
        pace = self.link.pace(asked.command.target)

        def intend() -> None:
            self.intend(asked)
            if before_sending:
                before_sending()

        attempt = 0
        while True:
            attempt += 1
            exchange = await self.link.ask(
                asked.command,
                timeout=pace.last_try_timeout if asked.is_last_try else None,
                alone=alone,
                expected=asked.is_expected,
                before_sending=intend,
            )
            if not isinstance(exchange, Answered) or attempt == BUSY_ATTEMPTS:
                return ProbeResult(exchange, attempt)
            verdict = self.link.codec.verdict(exchange.response.code)
            if verdict is Verdict.TARGET_UNAVAILABLE and not woken:
                woken = True
                await wake(self.link, asked.command.target)
            elif verdict is Verdict.BUSY:
                await asyncio.sleep(pause)
                pause *= 2
            else:
                return ProbeResult(exchange, attempt)


def payload_for(row: CommandRow | None, consent: Consent) -> bytes:
    """Return what to send where a plan leaves it open: the allowed properly, the rest at a wrong length.

    Args:
        row: what is known of the pair, None where nothing is.
        consent: what was allowed.
    """
    if row is None or row.kind is Kind.NOTIFICATION:
        return bytes(WRONG_LENGTH)
    if row.risk is Risk.READ or row.risk in consent.allowed:
        if row.sample is not None:
            return row.sample
        return row.request.zeros() if row.request else b""
    if row.risk is Risk.WRITE and row.request and row.request.accepts(WRONG_LENGTH):
        return b""  # too short for a command that takes any length from some minimum on
    return bytes(WRONG_LENGTH)
