"""One probe at a time: filling it in, assessing it by what was measured, and sending it."""

import asyncio
from collections.abc import Callable, Collection, Iterable
from typing import Final, NamedTuple

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.exchange import Answered, Blocked
from sphero_probe.link.length_checks import REFUSALS_WANTED
from sphero_probe.link.link import Link
from sphero_probe.link.policy import WRONG_LENGTH, Consent, is_impossible
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.calibration import Calibration
from sphero_probe.probing.device_calibration import DeviceCalibration, calibration_rows, has_setters
from sphero_probe.probing.plan import Probe
from sphero_probe.probing.profiles import DeviceProfile, NodeProfile, Strictness
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.identify import wake
from sphero_probe.session.reconnect import Reconnector

BUSY_ATTEMPTS: Final = 5
BUSY_PAUSE: Final = 0.1
"""Seconds before a busy robot is asked again; doubled each time."""


class FilledProbe(NamedTuple):
    """A probe with everything filled in that needs no measurement.

    Attributes:
        number: its place in the run, from 1.
        command: with node and payload.
        knowledge: the catalogue's row for this robot, None where there is none.
    """

    number: int
    command: Command
    knowledge: CommandRow | None


def _forget(_: PreparedProbe) -> None:
    pass


class Prober:
    """Prepares and sends the probes of one run.

    Attributes:
        profiles: node -> what calibration measured on it.
        devices: node and device -> what calibration measured in it.
        claimed: node, device and command ids that the robot lists as its own.
        intend: told of each probe before it goes out, each time it does.
        line: to the robot.
        target: the address byte of the robot's usual node.
    """

    def __init__(self, line: Reconnector, target: int | None) -> None:
        self.profiles: dict[int | None, NodeProfile] = {}
        self.devices: dict[tuple[int | None, int], DeviceProfile] = {}
        self.claimed: set[tuple[int | None, int, int]] = set()
        self.intend: Callable[[PreparedProbe], None] = _forget
        self.line = line
        self.target = target
        self._absent: set[tuple[int | None, int]] = set()
        self._calibrations: dict[tuple[int | None, int], DeviceCalibration] = {}

    @property
    def link(self) -> Link:
        """The open link; another one after a reconnect."""
        return self.line.link

    def masks(self, target: int | None) -> bool:
        """Whether this node may refuse lengths even where no command exists: only a strict one does not."""
        profile = self.profiles.get(target)
        return profile is None or profile.strictness is not Strictness.STRICT

    def fill(self, number: int, probe: Probe) -> FilledProbe:
        """Fill in node and payload, and look up what is known of the pair."""
        policy = self.link.policy
        command = probe.command
        if command.target is None:
            command = command._replace(target=self.target)
        row = lookup(self.link.codec.generation, command.did, command.cid, policy.robot)
        if not probe.exact and not command.payload:
            command = command._replace(payload=payload_for(row, policy.consent))
        return FilledProbe(number, command, row)

    async def calibrate(self, target: int | None, dids: Collection[int] = ()) -> NodeProfile:
        """Measure how a node treats lengths.

        Args:
            target: the node's address byte.
            dids: devices that will be probed.

        Raises:
            LinkLostError: the robot is gone.
        """
        profile = await Calibration(self.line, target, dids).measure()
        self.profiles[target] = profile
        return profile

    async def calibrate_devices(self, devices: Iterable[tuple[int | None, int]]) -> list[DeviceProfile]:
        """Measure devices that were not measured yet; return their profiles.

        Reads are asked of all devices at once. Setters get their wrong length one after the other: the first
        that accepts it is the last.

        Args:
            devices: node and device id of each.

        Raises:
            LinkLostError: the robot is gone.
        """
        keys = [key for key in dict.fromkeys(devices) if key not in self.devices]
        for key in keys:
            self._calibrations.setdefault(key, DeviceCalibration(self.line, *key))
        calibrations = [self._calibrations[key] for key in keys]
        await ask_together(calibration.ask_reads() for calibration in calibrations)
        for calibration in calibrations:
            await calibration.ask_setters()
        found = [calibration.profile() for calibration in calibrations]
        self.devices.update(zip(keys, found, strict=True))
        self.claimed |= {(one.target, one.did, cid) for one in found for cid in one.claimed}
        return found

    def learn(self, command: Command, answer: Answered) -> None:
        """Take in an answer; it may tell that the node has no such device."""
        if self.link.codec.verdict(answer.response.code) is Verdict.NO_DEVICE:
            self._absent.add((command.target, command.did))

    def _is_absent(self, target: int | None, did: int) -> bool:
        """Whether the node has no such device, as far as it said."""
        profile = self.devices.get((target, did))
        return (target, did) in self._absent or (profile is not None and not profile.exists)

    def has_evidence(self, command: Command) -> bool:
        """Whether a command of this device refused a wrong length, or the device does not exist."""
        if self._is_absent(command.target, command.did):
            return True
        return bool(self.link.policy.length_checks.refusals(command.target, command.did))

    def is_proved(self, target: int | None, did: int) -> bool:
        """Whether enough commands of a device refused a wrong length to have several in flight.

        Two must have, and one of them must be no read where the device has documented setters.
        """
        if self._is_absent(target, did):
            return True
        policy, generation = self.link.policy, self.link.codec.generation
        refused = policy.length_checks.refusals(target, did)
        if len(refused) < REFUSALS_WANTED:
            return False
        if not has_setters(generation, policy.robot, did):
            return True
        reads, _ = calibration_rows(generation, policy.robot, did)
        return not refused <= {row.cid for row in reads}

    def prepare(self, filled: FilledProbe) -> PreparedProbe:
        """Assess a probe by what was measured so far."""
        number, command, row = filled
        risk, _, blocked = self.link.policy.assess(command)
        if len(command.payload) > self.link.codec.max_payload:
            blocked = f"a payload of {len(command.payload)} bytes fits no frame of this robot"
        wrong_length = not blocked and risk is Risk.PROBE and not is_impossible(command)
        may_exist = wrong_length and (
            (row is not None and row.kind is Kind.COMMAND)
            or (command.target, command.did, command.cid) in self.claimed
        )
        return PreparedProbe(
            number,
            command,
            risk,
            row,
            blocked,
            is_wrong_length=wrong_length,
            may_exist=may_exist,
        )

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
