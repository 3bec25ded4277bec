"""Show what a plan would send, without a robot: exact bytes, risk classes, and what is blocked."""

from collections.abc import Iterator
from itertools import count
from typing import Final, NamedTuple

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import CommandRow, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS, IMPOSSIBLE_DIDS, is_wrong_length
from sphero_probe.probing.calibration_rows import calibration_rows
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plans.loader import probes_of
from sphero_probe.probing.prober import payload_for
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.simulator.measured_timing import IN_FLIGHT, ROUND_TRIPS

_INTERVAL: Final = 0.015
_PER_EVENT: Final = 6
"""Seconds between the connection events of a fast Bluetooth link, and packets in each: one for each probe."""
FASTEST: Final = _INTERVAL / _PER_EVENT
"""Seconds per probe on a fast Bluetooth link, without retries and calibration."""
SLOWEST: Final = next(seconds for share, seconds in ROUND_TRIPS if share >= 0.5) / IN_FLIGHT
"""Seconds per probe with the round trips of a real Mini and no more in flight than its app had."""


class PlannedProbe(NamedTuple):
    """A probe that would be sent.

    Attributes:
        number: its place in the plan, from 1.
        command: with node and payload.
        knowledge: the catalogue's row, None if no catalogue knows the pair.
        risk: the class of sending it.
        frame: the bytes that would be sent.
        blocked: why the policy blocks it, None if it would be sent.
    """

    number: int
    command: Command
    knowledge: CommandRow | None
    risk: Risk
    frame: bytes
    blocked: str | None


def planned_probes(
    plan: Plan,
    generation: Generation,
    robot: Robot | None,
    consent: Consent,
    target: int | None,
    name: str = "",
) -> Iterator[PlannedProbe]:
    """Yield what each probe would send, assuming what calibration finds on a robot that checks lengths.

    Args:
        plan: what to send; stages that are made from findings are left out.
        generation: the robot's protocol.
        robot: the model, None if it is not known.
        consent: what is allowed.
        target: address byte for probes that name no node; None leaves addresses out.
        name: the robot's name, for the class ``brick``.
    """
    codec = CODECS[generation]
    policy = Policy(generation, robot, consent, (name,) if name else ())
    numbers = count(1)
    sequence = codec.sequence_numbers
    for stage in plan.stages:
        if callable(stage):
            continue
        for probe in probes_of(plan, stage, ()):
            number = next(numbers)
            command = probe.command
            if command.target is None:
                command = command._replace(target=target)
            row = lookup(generation, command.did, command.cid, robot)
            if not probe.exact and not command.payload:
                command = command._replace(payload=payload_for(row, consent))
            _assume_strict(policy, command.target, command.did)
            if is_wrong_length(command, row):
                _assume_absent(policy, command.target, command.did)
            frame = codec.encode_command(command, sequence[(number - 1) % len(sequence)])
            risk, blocked = policy.assess(command).risk, policy.why_blocked(command)
            yield PlannedProbe(number, command, row, risk, frame, blocked)


def _assume_strict(policy: Policy, target: int | None, did: int) -> None:
    """Tell the policy that a node and a device check lengths, as if calibration had found so."""
    checks = policy.length_checks
    if not checks.is_strict(target):
        checks.trust(target)
    reads, setters = calibration_rows(policy.generation, policy.robot, did)
    for row in (*reads, *setters):
        checks.add_rejection(Command(did, row.cid, b"", target))


def _assume_absent(policy: Policy, target: int | None, did: int) -> None:
    """Tell the policy that a node and a device lack what cannot exist, as if calibration had found so."""
    policy.length_checks.mark_absent(Command(IMPOSSIBLE_DIDS[0], 0, b"", target))
    policy.length_checks.mark_absent(Command(did, IMPOSSIBLE_CIDS[0], b"", target))
