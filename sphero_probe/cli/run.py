"""Runs a plan, reports it and keeps its journal, for ``sweep``, ``discover`` and ``info``."""

import asyncio
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import aclosing, asynccontextmanager, contextmanager
from typing import Final

from sphero_probe.cli.baseline import Baseline
from sphero_probe.cli.brief_table import brief_table
from sphero_probe.cli.capture_comments import CommentingRecorder
from sphero_probe.cli.connect import connect
from sphero_probe.cli.journal import resume_hint
from sphero_probe.cli.messages import say
from sphero_probe.cli.next_step import suggest_next
from sphero_probe.cli.output import report
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import AskOptions, ConnectOptions, Output
from sphero_probe.errors import IncompleteError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.engine import Engine
from sphero_probe.probing.finding import Finding, Heading, Note, Record, Summary
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.progress import Progress
from sphero_probe.probing.recorder import NullRecorder
from sphero_probe.reports.registry import PAGES
from sphero_probe.reports.rows import Row, finding_row, heading_row, note_row, summary_row
from sphero_probe.reports.run_ending import RunEnding
from sphero_probe.reports.streams import takes_unicode, wants_color
from sphero_probe.reports.views import FINDINGS
from sphero_probe.runs.resume import RunJournal
from sphero_probe.runs.running import engine_for, records_of
from sphero_probe.session.commands import node
from sphero_probe.session.session import Session

_REFRESH: Final = 0.2
"""Seconds between two updates of the progress."""


def run_plan(
    plan: Plan,
    output: Output,
    connecting: ConnectOptions,
    asking: AskOptions,
    journal: RunJournal,
    baseline: Baseline,
) -> Heading | None:
    """Run a plan, report it and keep its journal; return the heading of the run.

    Args:
        plan: what to ask.
        output: where and how to report.
        connecting: which robot.
        asking: what is allowed, and of which node.
        journal: of the run, entered.
        baseline: what to compare the run with; one that is incomplete is compared, too, and not written.

    Raises:
        SpheroProbeError: the robot cannot be reached, the link was lost, or a complete run differs from its
            baseline, or has an outcome that it must not have.
        InterruptedRunError: a signal ended the run.
        IncompleteError: part of the plan has no result for another reason; the message names it.
    """
    consent = Consent.of(asking.allow, asking.confirm)
    target = journal.check(plan, consent, asking.target)
    interrupts = Interrupts()
    complete, ending = False, RunEnding()
    heading: Heading | None = None

    async def work() -> None:
        nonlocal complete, heading
        async with connect(connecting, consent, timeout=asking.timeout) as session:
            _warn_of_other_robot(plan, session)
            journal.begin(session.connection, plan, consent, target)
            run = start_run(plan, session, target, interrupts, journal)
            with (
                brief_table(output) as shown,
                report(output, FINDINGS) as rows,
                progress(plan.name, output) as show_progress,
            ):
                async with (
                    _shown_regularly(run, show_progress),
                    aclosing(records_of(run, session)) as records,
                ):
                    async for record in records:
                        row = row_of(record)
                        ending.add(row)
                        rows.add(row)
                        shown(row)
                        if isinstance(record, Heading):
                            heading = record
                        baseline.add(record)
                        complete = isinstance(record, Summary) and record.complete
                baseline.compare(session.link.codec, rows)

    with resume_hint(journal, connecting, consent):
        run_interruptible(interrupts, work())
        baseline.show(output)
        baseline.judge()
        if not complete:
            baseline.keep()
            raise IncompleteError(ending.message())
    baseline.finish()
    suggest_next(journal.journal.path if journal.journal else None, heading, output)
    return heading


@asynccontextmanager
async def _shown_regularly(run: Engine, show: Callable[[Progress], None]) -> AsyncIterator[None]:
    """Show how far the run is while the block lasts."""

    async def work() -> None:
        while True:
            show(run.progress())
            await asyncio.sleep(_REFRESH)

    showing = asyncio.create_task(work())
    try:
        yield
    finally:
        showing.cancel()


def _warn_of_other_robot(plan: Plan, session: Session) -> None:
    robot = session.connection.robot
    if plan.robots and (robot is None or robot.key not in plan.robots):
        say(f"note: the plan {plan.name} is meant for {', '.join(plan.robots)}")


def start_run(
    plan: Plan,
    session: Session,
    target: str | None,
    interrupts: Interrupts,
    journal: RunJournal | None = None,
) -> Engine:
    """Return a run that the first Ctrl-C stops cleanly, and that resumes what its journal holds.

    Args:
        plan: what to ask.
        session: with the robot.
        target: the node as typed, None for the robot's usual one.
        interrupts: of the command.
        journal: of the run, None to keep none.
    """
    connection = session.connection
    stop = asyncio.Event()
    interrupts.stop_politely(stop)
    return engine_for(
        *(plan, session, node(target, connection.robot, connection.port), stop, journal),
        recorder=CommentingRecorder(journal or NullRecorder(), session.link.events),
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
def progress(title: str, output: Output) -> Iterator[Callable[[Progress], None]]:
    """Show the stage, what was found and the time left while standard error is a terminal.

    It is left out where rows are printed on a terminal as they arrive: they show the progress.

    Args:
        title: what is shown before the first step is reported.
        output: where and how the rows are written.

    Yields:
        A function that takes how far the run is.
    """
    rows_run = output.file is None and output.format not in PAGES and sys.stdout.isatty()
    if rows_run or not sys.stderr.isatty():
        yield lambda _: None
        return
    from sphero_probe.cli.progress_bar import progress_bar  # noqa: PLC0415 - imports rich, which a pipe never needs

    color, unicode = wants_color(output.color, sys.stderr), takes_unicode(sys.stderr)
    with progress_bar(title, color=color, unicode=unicode) as show_progress:
        yield show_progress
