"""One probe at a time: a probe in, made ready by catalogue and calibration; how asking it ended out."""

import asyncio
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.roles import VERSION_FIELDS, Job, row_for
from sphero_probe.link.exchange import Answered, Exchange, Refused, Silent
from sphero_probe.link.guard import WRONG_LENGTH, Consent
from sphero_probe.link.link import Link
from sphero_probe.probing.calibration import Calibration, Profile, Strictness
from sphero_probe.probing.flight import ATTEMPTS, together
from sphero_probe.probing.plan import Probe
from sphero_probe.protocol.packets import Command, Verdict

BUSY_ATTEMPTS: Final = 5
BUSY_PAUSE: Final = 0.1
"""Seconds before a busy robot is asked again; doubled each time."""


class Asked(NamedTuple):
    """A probe made ready.

    Attributes:
        number: its place in the run, from 1.
        command: with node and payload filled in.
        risk: the class of sending it.
        knowledge: the catalogue's row for this robot, None where there is none.
        barred: why it must not be sent, empty when it may.
        is_last_try: it gets the whole timeout, whatever is answered meanwhile.
    """

    number: int
    command: Command
    risk: Risk
    knowledge: CommandRow | None
    barred: str
    is_last_try: bool = False

    @property
    def is_expected(self) -> bool:
        """Whether an answer is sure to come: it is a documented query."""
        return self.knowledge is not None and self.knowledge.risk is Risk.READ and self.risk is Risk.READ


class Tried(NamedTuple):
    """How asking a probe ended, and how often it went out for that."""

    exchange: Exchange
    attempts: int


def _forget(_: Asked) -> None:
    pass


class Asker:
    """Asks one robot over one link.

    Attributes:
        profiles: node -> what calibration measured on it.
        intend: told of each probe before it goes out, each time it does.
        link: to the robot; another one after the line was opened anew.
    """

    def __init__(self, link: Link, target: int | None) -> None:
        self.profiles: dict[int | None, Profile] = {}
        self.intend: Callable[[Asked], None] = _forget
        self.link = link
        self._target = target

    def masks(self, target: int | None) -> bool:
        """Whether this node may refuse lengths even where no command exists: only a strict one does not."""
        profile = self.profiles.get(target)
        return profile is None or profile.strictness is not Strictness.STRICT

    def must_measure(self, probe: Probe) -> bool:
        """Whether ``prepare`` will calibrate the probe's node first."""
        return self._needs_profile(self._complete(probe)[0])

    async def prepare(self, number: int, probe: Probe) -> tuple[Asked, Profile | None]:
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

    def complete(self, number: int, probe: Probe) -> Asked:
        """Fill in node and payload, and judge the probe by what is known so far."""
        guard = self.link.guard
        command, row = self._complete(probe)
        barred = guard.why_not(command) or ""
        if len(command.payload) > self.link.codec.max_payload:
            barred = f"a payload of {len(command.payload)} bytes fits no frame of this robot"
        return Asked(number, command, guard.assess(command).risk, row, barred)

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
        guard = self.link.guard
        command = probe.command
        if command.target is None:
            command = command._replace(target=self._target)
        row = lookup(self.link.codec.generation, command.did, command.cid, guard.robot)
        if not probe.exact and not command.payload:
            command = command._replace(payload=payload_for(row, guard.consent))
        return command, row

    def _needs_profile(self, command: Command) -> bool:
        """Whether how this node treats lengths matters for the command, and is not yet known."""
        guard = self.link.guard
        by_length = guard.assess(command).risk is Risk.PROBE or guard.hinges_on_length_check(command)
        return by_length and command.target not in self.profiles

    async def ask(
        self, asked: Asked, before_sending: Callable[[], None] | None = None, *, alone: bool = False
    ) -> Tried:
        """Ask one probe; a busy robot is asked again after a pause, a sleeping node is woken once.

        Args:
            asked: the probe.
            before_sending: called each time it is about to go out.
            alone: with nothing else in flight.

        Raises:
            LinkLostError: the robot is gone.
        """
        if asked.barred:
            return Tried(Refused(asked.command, asked.risk, asked.barred), 0)
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
                timeout=pace.unhurried if asked.is_last_try else None,
                alone=alone,
                expected=asked.is_expected,
                before_sending=intend,
            )
            if not isinstance(exchange, Answered) or attempt == BUSY_ATTEMPTS:
                return Tried(exchange, attempt)
            verdict = self.link.codec.verdict(exchange.response.code)
            if verdict is Verdict.TARGET_UNAVAILABLE and not woken:
                woken = True
                await self.do(Job.WAKE, asked.command.target)
            elif verdict is Verdict.BUSY:
                await asyncio.sleep(pause)
                pause *= 2
            else:
                return Tried(exchange, attempt)

    async def do(self, job: Job, target: int | None, attempts: int = ATTEMPTS) -> Exchange | None:
        """Ask the documented read that does a job; None where the generation has none.

        Args:
            job: what is to be done.
            target: the node.
            attempts: how often it is asked while it stays silent.

        Raises:
            LinkLostError: the robot is gone.
        """
        row = row_for(self.link.codec.generation, job)
        if row is None:
            return None
        command = Command(row.did, row.cid, b"", target)
        exchange = await self.link.ask(command, expected=True)
        for _ in range(attempts - 1):
            if not isinstance(exchange, Silent):
                break
            exchange = await self.link.ask(command, alone=True)
        return exchange

    async def wake(self) -> None:
        """Wake the robot's usual node.

        Raises:
            LinkLostError: the robot is gone.
        """
        await self.do(Job.WAKE, self._target)

    async def firmware(self) -> dict[str, str]:
        """Return the firmware version, per node name; a robot that never said anything is asked once.

        Raises:
            LinkLostError: the robot is gone.
        """
        robot = self.link.guard.robot
        nodes = robot.nodes if robot and self._target is not None else {0: "robot"}
        versions: dict[str, str] = {}
        row = row_for(self.link.codec.generation, Job.VERSION)
        targets = [None if self._target is None else self._target & 0xF0 | node for node in nodes]
        attempts = ATTEMPTS if self.link.answers else 1
        exchanges = await together(self.do(Job.VERSION, target, attempts) for target in targets)
        for name, exchange in zip(nodes.values(), exchanges, strict=True):
            if isinstance(exchange, Answered) and exchange.response.payload and row and row.response:
                fields = row.response.decode(exchange.response.payload).fields
                parts = (fields.get(part) for part in VERSION_FIELDS[row.generation])
                versions[name] = ".".join(str(part) for part in parts if part is not None)
        return versions


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
