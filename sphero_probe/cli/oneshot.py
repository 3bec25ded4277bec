"""Sends single commands to one robot, for ``send`` and ``led``."""

from collections.abc import Callable
from contextlib import aclosing

from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.capture_comments import CommentingRecorder
from sphero_probe.cli.connect import connect
from sphero_probe.cli.dry_run import show_dry_run
from sphero_probe.cli.journal import run_journal
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import AskOptions, ConnectOptions, JournalOptions, Output
from sphero_probe.errors import (
    CommandFailedError,
    NoAnswerError,
    RefusedByPolicyError,
    SpheroProbeError,
)
from sphero_probe.link.policy import Consent
from sphero_probe.probing.finding import Finding
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.rows import finding_row
from sphero_probe.reports.views import FINDING
from sphero_probe.runs.resume import RunJournal
from sphero_probe.runs.sending import plan_of, send_each
from sphero_probe.session.addressing import address_of, model_behind, port_behind
from sphero_probe.session.session import Session

CommandsFor = Callable[[Robot | None, int], tuple[Command, ...]]
"""Makes the commands from the robot's model, None for an unknown one, and the port nibble of the link."""


def send_commands(
    name: str,
    make: CommandsFor,
    consent: Consent,
    output: Output,
    connecting: ConnectOptions,
    asking: AskOptions,
    journal: JournalOptions,
) -> None:
    """Send each command in turn until one fails, and show the findings; or show what would be sent.

    Args:
        name: whose run it is: ``send`` or ``led``.
        make: makes the commands.
        consent: what is allowed.
        output: where and how to show the findings.
        connecting: which robot.
        asking: the timeout, and whether this is a dry run.
        journal: which journal to keep.

    Raises:
        RefusedByPolicyError: a command was not allowed.
        CommandFailedError: the robot answered with an error, or not to this command.
        SpheroProbeError: the robot cannot be reached, or answers nothing at all.
    """
    if asking.dry_run:
        address = address_of(connecting.device)
        plan = plan_of(name, make(model_behind(address), port_behind(address)))
        show_dry_run(output, plan, address, consent, None)
        return
    found: list[Finding] = []
    failed: list[SpheroProbeError] = []

    async def work() -> None:
        try:
            async with connect(connecting, consent, timeout=asking.timeout) as session:
                await _ask_each(name, make, session, kept, found)
        except (RefusedByPolicyError, CommandFailedError, NoAnswerError) as error:
            failed.append(error)

    with run_journal(name, journal) as kept:
        run_interruptible(Interrupts(), work())
    show(output, FINDING, map(finding_row, found))
    if failed:
        raise failed[0]


async def _ask_each(
    name: str, make: CommandsFor, session: Session, journal: RunJournal, found: list[Finding]
) -> None:
    """Send each command in turn, and add its finding to ``found``.

    Raises:
        SpheroProbeError: one failed; the rest is not sent.
    """
    connection = session.connection
    commands = make(connection.robot, connection.port)
    recorder = CommentingRecorder(journal, session.link.events)
    async with aclosing(send_each(name, commands, session, journal, recorder)) as records:
        async for record in records:
            if isinstance(record, Finding):
                found.append(record)
            else:
                say(f"note: {record.text}")
