"""Send single commands to one robot, one after the other, and keep their journal."""

from collections import Counter
from collections.abc import AsyncGenerator, Sequence
from contextlib import suppress
from time import monotonic

from sphero_probe.errors import CommandFailedError, LinkLostError, NoAnswerError, RefusedByPolicyError
from sphero_probe.probing.failures import check
from sphero_probe.probing.finding import Finding, Note, Summary
from sphero_probe.probing.notes import tolerance_notes
from sphero_probe.probing.oneshot import heading_of, send_once, stop_motors
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.recorder import Recorder
from sphero_probe.protocol.packets import Command
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.session import Session


def plan_of(name: str, commands: Sequence[Command]) -> Plan:
    """Return the plan that sends exactly these commands.

    Args:
        name: whose run it is: ``send`` or ``led``.
        commands: with payload and node.
    """
    return Plan(name, "", [[Probe(command, exact=True) for command in commands]])


async def send_each(
    name: str,
    commands: Sequence[Command],
    session: Session,
    journal: RunJournal,
    recorder: Recorder | None = None,
) -> AsyncGenerator[Finding | Note, None]:
    """Send each command in turn until one fails; yield its finding, and notes at the end.

    Args:
        name: whose run it is: ``send`` or ``led``.
        commands: with payload and node; at least one.
        session: with the robot.
        journal: of the run, entered.
        recorder: what records the run, None for the journal.

    Raises:
        RefusedByPolicyError: a command was not allowed.
        CommandFailedError: the robot answered with an error, or not to this command.
        SpheroProbeError: the robot answers nothing at all, or the journal cannot be written.
    """
    failed: RefusedByPolicyError | CommandFailedError | NoAnswerError | None = None
    connection, link = session.connection, session.link
    plan = plan_of(name, commands)
    journal.begin(connection, plan, link.policy.consent, None)
    recorder = recorder or journal
    recorder.record(heading_of(plan, link, connection.name, connection.line))
    began, frames = monotonic(), link.frames_sent
    found: list[Finding] = []
    try:
        for number, command in enumerate(commands, 1):
            finding = await send_once(link, command, number, recorder.intend, journal.announce)
            found.append(finding)
            yield finding
            recorder.record(finding)
            await check(finding, session)
    except (RefusedByPolicyError, CommandFailedError, NoAnswerError) as error:
        failed = error
    finally:
        with suppress(LinkLostError):
            await stop_motors(link, commands[0].target)
    for note in tolerance_notes(session.link.tolerated):
        recorder.record(note)
        yield note
    counts = dict(Counter(finding.outcome for finding in found))
    complete = len(found) == len(commands)
    sent = sum(finding.attempts > 0 for finding in found)
    seconds, frames = monotonic() - began, link.frames_sent - frames
    recorder.record(Summary(counts, seconds, sent, frames, complete))
    if failed:
        raise failed
