"""Sends single commands to one robot, for ``send`` and ``led``."""

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from time import monotonic

from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.connect import connect
from sphero_probe.cli.dry_run import show_dry_run
from sphero_probe.cli.journal import run_journal
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.remarks import RemarkingRecorder
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import AskOptions, ConnectOptions, JournalOptions, Output
from sphero_probe.errors import (
    CommandFailedError,
    LinkLostError,
    NoAnswerError,
    RefusedByPolicyError,
    SpheroProbeError,
)
from sphero_probe.link.policy import Consent
from sphero_probe.probing.failures import check
from sphero_probe.probing.finding import Finding, Summary
from sphero_probe.probing.notes import tolerance_notes
from sphero_probe.probing.oneshot import heading_of, send_once, stop_motors
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.rows import finding_row
from sphero_probe.reports.views import FINDING
from sphero_probe.runs.resume import RunJournal
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
        plan = _plan(name, make(model_behind(address), port_behind(address)))
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


def _plan(name: str, commands: tuple[Command, ...]) -> Plan:
    return Plan(name, "", [[Probe(command, exact=True) for command in commands]])


async def _ask_each(
    name: str, make: CommandsFor, session: Session, journal: RunJournal, found: list[Finding]
) -> None:
    """Send each command in turn, and add its finding to ``found``.

    Raises:
        SpheroProbeError: one failed; the rest is not sent.
    """
    failed: SpheroProbeError | None = None
    connection, link = session.connection, session.link
    commands = make(connection.robot, connection.port)
    plan = _plan(name, commands)
    journal.begin(connection, plan, link.policy.consent, None)
    recorder = RemarkingRecorder(journal, link.events)
    recorder.record(heading_of(plan, link, connection.name, connection.line))
    began, frames = monotonic(), link.frames_sent
    try:
        for number, command in enumerate(commands, 1):
            finding = await send_once(link, command, number, recorder.intend)
            found.append(finding)
            recorder.record(finding)
            await check(finding, session)
    except (RefusedByPolicyError, CommandFailedError, NoAnswerError) as error:
        failed = error
    finally:
        with suppress(LinkLostError):
            await stop_motors(link, commands[0].target)
    for note in tolerance_notes(session.link.tolerated):
        recorder.record(note)
        say(f"note: {note.text}")
    counts = dict(Counter(finding.outcome for finding in found))
    complete = len(found) == len(commands)
    sent = sum(finding.attempts > 0 for finding in found)
    seconds, frames = monotonic() - began, link.frames_sent - frames
    recorder.record(Summary(counts, seconds, sent, frames, complete))
    if failed:
        raise failed
