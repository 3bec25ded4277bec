"""What would be sent: a plan and consent in, rows with exact bytes, risk and what is withheld out."""

from collections.abc import Iterator
from itertools import count

import click

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import Robot
from sphero_probe.link.guard import Consent, Guard
from sphero_probe.probing.asking import payload_for
from sphero_probe.probing.plan import Plan, probes_of
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.rows import Row, planned_row


def planned_rows(
    plan: Plan,
    generation: Generation,
    robot: Robot | None,
    consent: Consent,
    target: int | None,
    name: str = "",
) -> Iterator[Row]:
    """Yield what each probe would send, if calibration finds that the robot checks lengths."""
    codec = CODECS[generation]
    guard = Guard(generation, robot, consent, (name,) if name else ())
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
            guard.trust_length_check(command.target)
            frame = codec.encode_command(command, sequence[(number - 1) % len(sequence)])
            yield planned_row(number, command, row, guard.assess(command).risk, frame, guard.why_not(command))


def tell_dry_run() -> None:
    """Say on standard error what a dry run leaves out."""
    click.echo(
        "dry run: nothing is sent. A real run first wakes the robot, reads its version and measures\n"
        "whether it checks lengths; where it does not, what is unknown is withheld.",
        err=True,
    )
