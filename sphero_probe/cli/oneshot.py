"""Single commands for one robot: what ``send`` and ``led`` have in common."""

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any

from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.connect import connect
from sphero_probe.cli.dry_run import print_dry_run_note
from sphero_probe.cli.output import Output
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.errors import LinkLostError, NoAnswerError, SpheroProbeError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.dry_run import planned_probes
from sphero_probe.probing.failures import check
from sphero_probe.probing.finding import Finding, Summary
from sphero_probe.probing.oneshot import heading_of, send_once, stop_motors
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.rows import finding_row, planned_row
from sphero_probe.reports.views import FINDING, PLANNED
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.addressing import address_of, generation_behind, model_behind, port_behind

CommandsFor = Callable[[Robot | None, int], tuple[Command, ...]]
"""Makes the commands from the robot's model, None where it is not known, and the line's port nibble."""


def show_dry(output: Output, device: str, consent: Consent, make: CommandsFor) -> None:
    """Show the bytes that would go out, and touch nothing.

    Raises:
        SpheroProbeError: the command makes no sense for this robot.
    """
    address = address_of(device)
    robot = model_behind(address)
    probes = [Probe(command, exact=True) for command in make(robot, port_behind(address))]
    print_dry_run_note()
    rows = map(
        planned_row,
        planned_probes(Plan("single", "", [probes]), generation_behind(address), robot, consent, None),
    )
    output.show(PLANNED, rows)


def send_each(
    output: Output,
    device: str,
    consent: Consent,
    make: CommandsFor,
    run_journal: RunJournal,
    **connecting: Any,
) -> None:
    """Connect, ask each command in turn until one fails, show the findings.

    Raises:
        RefusedByPolicyError: the guard withheld one.
        RobotRefusedError: the robot answered with an error.
        SpheroProbeError: the robot cannot be reached, or did not answer.
    """
    found: list[Finding] = []
    failed: list[SpheroProbeError] = []

    async def work() -> None:
        async with connect(device, consent, **connecting) as session:
            connection, link = session.connection, session.link
            commands = make(connection.robot, connection.port)
            plan = Plan(run_journal.command, "", [[Probe(command, exact=True) for command in commands]])
            run_journal.begin(connection, plan, consent, None)
            run_journal.record(heading_of(plan, link, connection.name))
            began, frames = monotonic(), link.frames_sent
            try:
                for number, command in enumerate(commands, 1):
                    finding = await send_once(link, command, number, run_journal.intend)
                    found.append(finding)
                    run_journal.record(finding)
                    try:
                        complain(finding, link.codec)
                    except SpheroProbeError as error:
                        failed.append(error)
                        break
            finally:
                with suppress(LinkLostError):
                    await stop_motors(link, commands[0].target)
            counts = dict(Counter(finding.outcome for finding in found))
            complete = len(found) == len(commands)
            sent = sum(finding.attempts > 0 for finding in found)
            seconds, frames = monotonic() - began, link.frames_sent - frames
            run_journal.record(Summary(counts, seconds, sent, frames, complete))

    with run_journal:
        run_interruptible(Interrupts(), work())
    output.show(FINDING, map(finding_row, found))
    if failed:
        raise failed[0]


def complain(finding: Finding, codec: Codec) -> None:
    """Turn a finding that is no success into the error that ends the command.

    Raises:
        RefusedByPolicyError: our policy blocked the command.
        RobotRefusedError: the robot answered with an error.
        SpheroProbeError: no answer came; the robot itself was reached, so that this is no failed connection.
    """
    try:
        check(finding, codec)
    except NoAnswerError as error:
        raise SpheroProbeError(str(error), error.hint) from error
