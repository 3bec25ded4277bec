"""Prepare one probe at a time, by the catalogue and by what was measured, and send it."""

import asyncio
from collections.abc import Callable
from typing import Final, NamedTuple

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, Blocked
from sphero_probe.link.length_checks import REJECTIONS_WANTED
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent
from sphero_probe.link.wrong_lengths import WRONG_LENGTH, WRONG_PAYLOAD, is_impossible
from sphero_probe.probing.attempt import Announce, PreparedProbe, ProbeResult
from sphero_probe.probing.calibration_rows import calibration_rows, has_setters
from sphero_probe.probing.calibrations import Calibrations
from sphero_probe.probing.plan import Probe
from sphero_probe.probing.profiles import Strictness
from sphero_probe.probing.retries import LossEstimate
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.identify import wake
from sphero_probe.session.reconnect import Reconnector

BUSY_ATTEMPTS: Final = 5
BUSY_PAUSE: Final = 0.1
"""Seconds before a busy robot is asked again; doubled each time."""


class FilledProbe(NamedTuple):
    """A probe with node and payload filled in, before it is assessed.

    Attributes:
        number: its place in the run, from 1.
        command: with node and payload.
        knowledge: the catalogue's row for this robot, None if there is none.
    """

    number: int
    command: Command
    knowledge: CommandRow | None


def _forget(_: PreparedProbe) -> None:
    pass


class Prober:
    """Prepares and sends the probes of one run.

    Attributes:
        calibrations: measures nodes and devices.
        profiles: node -> what calibration measured on it.
        devices: node and device -> what calibration measured of it.
        claimed: node, device and command ids that the robot lists as its own.
        announce: awaited before each probe above the class ``probe``, None to wait for nothing.
        intend: called with each probe before each time it is sent.
        line: to the robot.
        target: the address byte of the robot's usual node.
        loss: how much the link loses.
    """

    def __init__(self, line: Reconnector, target: int | None) -> None:
        self.announce: Announce | None = None
        self.intend: Callable[[PreparedProbe], None] = _forget
        self.line = line
        self.target = target
        self.loss = LossEstimate()
        self.calibrations = Calibrations(line, self.loss)
        self.profiles = self.calibrations.profiles
        self.devices = self.calibrations.devices
        self.claimed = self.calibrations.claimed
        self._proved: set[tuple[int | None, int]] = set()
        self._announced = asyncio.Lock()
        self._absent: set[tuple[int | None, int]] = set()

    @property
    def link(self) -> Link:
        """The open link; another one after a reconnect."""
        return self.line.link

    def masks(self, target: int | None) -> bool:
        """Whether this node may reject lengths even of absent commands; only a strict one does not."""
        profile = self.profiles.get(target)
        return profile is None or profile.strictness is not Strictness.STRICT

    def fill(self, number: int, probe: Probe) -> FilledProbe:
        """Fill in node and payload, and look up the command in the catalogue."""
        policy = self.link.policy
        did, cid, payload, target, options = probe.command
        row = lookup(self.link.codec.generation, did, cid, policy.robot)
        if not payload and not probe.exact:
            payload = payload_for(row, policy.consent)
        target = self.target if target is None else target
        return FilledProbe(number, Command(did, cid, payload, target, options), row)

    def is_blocked(self, probe: Probe) -> bool:
        """Whether the policy will most likely block a probe; for a documented one, ``prepare`` may differ."""
        command = probe.command
        if command.target is None:
            command = command._replace(target=self.target)
        if not probe.exact and not command.payload:
            command = command._replace(payload=WRONG_PAYLOAD)
        return bool(self.link.policy.assess(command).blocked)

    def learn(self, command: Command, answer: Answered) -> None:
        """Learn from an answer that the node has no such device, if it says so."""
        if self.link.codec.verdict(answer.response.code) is Verdict.NO_DEVICE:
            self._absent.add((command.target, command.did))

    def _is_absent(self, target: int | None, did: int) -> bool:
        """Whether the node has no such device, as far as is known."""
        profile = self.devices.get((target, did))
        return (target, did) in self._absent or (profile is not None and not profile.exists)

    def has_evidence(self, command: Command) -> bool:
        """Whether a command of this device rejected a wrong length, or the device does not exist."""
        if self._is_absent(command.target, command.did):
            return True
        return bool(self.link.policy.length_checks.rejections(command.target, command.did))

    def is_proved(self, target: int | None, did: int) -> bool:
        """Whether enough commands of a device rejected a wrong length to have several in flight.

        At least two must have; if the device has documented setters, one of them must not be a read.
        """
        if (target, did) in self._proved:
            return True
        if is_proved := self._is_absent(target, did) or self._was_rejected(target, did):
            self._proved.add((target, did))
        return is_proved

    def _was_rejected(self, target: int | None, did: int) -> bool:
        policy, generation = self.link.policy, self.link.codec.generation
        rejected = policy.length_checks.rejections(target, did)
        if len(rejected) < REJECTIONS_WANTED:
            return False
        if not has_setters(generation, policy.robot, did):
            return True
        reads, _ = calibration_rows(generation, policy.robot, did)
        return not rejected <= {row.cid for row in reads}

    def prepare(self, filled: FilledProbe) -> PreparedProbe:
        """Assess a probe by the policy, with what was measured so far."""
        number, command, row = filled
        risk, _, blocked = self.link.policy.assess(command)
        if len(command.payload) > self.link.codec.max_payload:
            blocked = f"a payload of {len(command.payload)} bytes does not fit into a frame of this robot"
        wrong_length = not blocked and risk is Risk.PROBE and not is_impossible(command)
        may_exist = wrong_length and (
            (row is not None and row.kind is Kind.COMMAND)
            or (command.target, command.did, command.cid) in self.claimed
        )
        return PreparedProbe(
            number, command, risk, row, blocked, is_wrong_length=wrong_length, may_exist=may_exist
        )

    async def ask(
        self, probe: PreparedProbe, before_sending: Callable[[], None] | None = None, *, alone: bool = False
    ) -> ProbeResult:
        """Send one probe; if the robot is busy, retry after a pause; wake a sleeping node once.

        Args:
            probe: the probe.
            before_sending: called right before each time it is sent.
            alone: send it with nothing else in flight.

        Raises:
            LinkLostError: the link was lost.
        """
        if probe.blocked:
            return ProbeResult(Blocked(probe.command, probe.risk, probe.blocked), 0)
        if self.announce and max(probe.risk, self.link.policy.assess(probe.command).risk) > Risk.PROBE:
            async with self._announced:  # one at a time: what is announced and not sent counts as sent
                await self.announce(probe)
                return await self._ask(probe, before_sending, alone=alone)
        return await self._ask(probe, before_sending, alone=alone)

    async def _ask(
        self, probe: PreparedProbe, before_sending: Callable[[], None] | None, *, alone: bool
    ) -> ProbeResult:
        woken, pause = False, BUSY_PAUSE

        def intend() -> None:
            self.intend(probe)
            if before_sending:
                before_sending()

        attempt = 0
        while True:
            attempt += 1
            exchange = await self.line.link.ask(
                probe.command,
                alone=alone,
                expected=False if probe.was_silent else None,
                patience=probe.wait_until and max(0.0, probe.wait_until - asyncio.get_running_loop().time()),
                before_sending=intend,
            )
            if isinstance(exchange, Blocked):  # something was measured while it waited
                return ProbeResult(exchange, attempt - 1)
            if not isinstance(exchange, Answered) or attempt == BUSY_ATTEMPTS or self.line.is_stopped:
                return ProbeResult(exchange, attempt)
            verdict = self.link.codec.verdict(exchange.response.code)
            if verdict is Verdict.TARGET_UNAVAILABLE and not woken:
                woken = True
                await wake(self.link, probe.command.target)
            elif verdict is Verdict.BUSY:
                await self.line.pause(pause)
                pause *= 2
            else:
                return ProbeResult(exchange, attempt)


def payload_for(row: CommandRow | None, consent: Consent) -> bytes:
    """Return the payload for a probe without one: proper arguments if allowed, else a wrong length.

    Args:
        row: the catalogue's row of the command, None if there is none.
        consent: what was allowed.
    """
    if row is None or row.kind is Kind.NOTIFICATION:
        return WRONG_PAYLOAD
    if row.risk is Risk.READ or row.risk in consent.allowed:
        if row.sample is not None:
            return row.sample
        return row.request.zeros() if row.request else b""
    if row.risk is Risk.WRITE and row.request and row.request.accepts(WRONG_LENGTH):
        return b""  # too short for a command that takes any length from some minimum on
    return WRONG_PAYLOAD
