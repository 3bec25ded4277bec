"""A plan and a robot's address go in, a report of the run comes out, with progress on standard error."""

import sys
from asyncio import Event
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from sphero_probe.cli.connect import connect
from sphero_probe.cli.output import Output, say
from sphero_probe.cli.parse import node
from sphero_probe.cli.resume_hint import resume_hint
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.errors import IncompleteError, LinkLostError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Heading, Note, Record, Summary
from sphero_probe.probing.oneshot import stop_motors
from sphero_probe.probing.plan import Plan
from sphero_probe.reports.rows import Row, finding_row, heading_row, note_row, summary_row
from sphero_probe.reports.streams import takes_unicode, wants_color
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.session import Session


def run_plan(
    plan: Plan,
    output: Output,
    device: str,
    consent: Consent,
    target: str | None,
    run_journal: RunJournal,
    **connecting: Any,
) -> None:
    """Ask a plan, report it and keep its journal.

    Args:
        plan: what to ask.
        output: where and how to report.
        device: the robot's address.
        consent: what is allowed.
        target: the node as it was typed, None for the robot's usual one.
        run_journal: of the journal, entered.
        **connecting: what ``open_session`` takes besides.

    Raises:
        SpheroProbeError: the robot cannot be reached, or the link was lost beyond the last finding.
        InterruptedRunError: a signal ended the run.
        IncompleteError: something else did.
    """
    from sphero_probe.reports.views import FINDINGS

    target = run_journal.check(plan, consent, target)
    interrupts = Interrupts()
    complete = False

    async def work() -> None:
        nonlocal complete
        async with connect(device, consent, **connecting) as session:
            _warn_of_other_robot(plan, session)
            run_journal.begin(session.connection, plan, consent, target)
            run = start_run(plan, session, target, interrupts, run_journal)
            with output.report(FINDINGS) as report, progress(plan.name, output) as advance:
                try:
                    async for record in run.records():
                        report.add(row_of(record))
                        if isinstance(record, Finding):
                            advance(len(run.findings), run.total)
                        complete = isinstance(record, Summary) and record.complete
                finally:
                    with suppress(LinkLostError):
                        await stop_motors(session.link, run.target)

    with resume_hint(run_journal, device, consent):
        run_interruptible(interrupts, work())
        if not complete:
            raise IncompleteError("the run ended before everything was asked")


def _warn_of_other_robot(plan: Plan, session: Session) -> None:
    robot = session.connection.robot
    if plan.robots and (robot is None or robot.key not in plan.robots):
        say(f"note: the plan {plan.name} is meant for {', '.join(plan.robots)}")


def start_run(
    plan: Plan,
    session: Session,
    target: str | None,
    interrupts: Interrupts,
    run_journal: RunJournal | None = None,
) -> Engine:
    """Make a run that the first Ctrl-C stops politely, and that goes on where the keeper's journal ends."""
    connection = session.connection
    stop = Event()
    interrupts.stop_politely(stop)
    address = node(target, connection.robot, connection.port)
    journal_choice = {"recorder": run_journal, "earlier": run_journal.earlier} if run_journal else {}
    return Engine(
        *(plan, session.link, connection.name, address, stop),
        reconnect=session.reconnect,
        on_step=session.on_step,
        **journal_choice,  # type: ignore[arg-type]
    )


def row_of(record: Record) -> Row:
    """Return the row that shows a record of a run."""
    match record:
        case Heading():
            return heading_row(record)
        case Finding():
            return finding_row(record)
        case Note():
            return note_row(record)
        case Summary():
            return summary_row(record)


@contextmanager
def progress(title: str, output: Output) -> Iterator[Callable[[int, int], None]]:
    """Show a bar with rate and time left while standard error is a terminal.

    Where rows run over a terminal as they come, they are the progress themselves.
    """
    rows_run = output.file is None and output.format != "table" and sys.stdout.isatty()
    if rows_run or not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from sphero_probe.cli.progress_bar import progress_bar

    color, unicode = wants_color(output.color, sys.stderr), takes_unicode(sys.stderr)
    with progress_bar(title, color=color, unicode=unicode) as advance:
        yield advance
