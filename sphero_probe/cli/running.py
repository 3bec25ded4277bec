"""A plan and a robot's address go in, a report of the run comes out, with progress on standard error."""

import sys
from asyncio import Event
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from sphero_probe.cli.interrupts import Interrupts, run_interruptible
from sphero_probe.cli.keeping import Keeper
from sphero_probe.cli.output import Output, say, takes_unicode, wants_color
from sphero_probe.cli.session import Session, open_session
from sphero_probe.cli.words import node
from sphero_probe.errors import IncompleteError, LinkLostError
from sphero_probe.link.guard import Consent
from sphero_probe.probing.engine import Run
from sphero_probe.probing.finding import Finding, Heading, Note, Record, Summary
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.single import stop_motors
from sphero_probe.reports.rows import Row, finding_row, heading_row, note_row, summary_row


def run_plan(
    plan: Plan,
    output: Output,
    device: str,
    consent: Consent,
    target: str | None,
    keeper: Keeper,
    **connecting: Any,
) -> None:
    """Ask a plan, report it and keep its journal.

    Args:
        plan: what to ask.
        output: where and how to report.
        device: the robot's address.
        consent: what is allowed.
        target: the node as it was typed, None for the robot's usual one.
        keeper: of the journal, entered.
        **connecting: what ``open_session`` takes besides.

    Raises:
        SpheroProbeError: the robot cannot be reached, or the link was lost beyond the last finding.
        InterruptedRunError: a signal ended the run.
        IncompleteError: something else did.
    """
    from sphero_probe.reports.views import FINDINGS

    target = keeper.check(plan, consent, target)
    interrupts = Interrupts()
    complete = False

    async def work() -> None:
        nonlocal complete
        async with open_session(device, consent, **connecting) as session:
            _warn_of_other_robot(plan, session)
            keeper.begin(session.connection, plan, consent, target)
            run = start_run(plan, session, target, interrupts, keeper)
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

    with keeper.telling_how_to_go_on(device, consent):
        run_interruptible(interrupts, work())
        if not complete:
            raise IncompleteError("the run ended before everything was asked")


def _warn_of_other_robot(plan: Plan, session: Session) -> None:
    robot = session.connection.robot
    if plan.robots and (robot is None or robot.key not in plan.robots):
        say(f"note: the plan {plan.name} is meant for {', '.join(plan.robots)}")


def start_run(
    plan: Plan, session: Session, target: str | None, interrupts: Interrupts, keeper: Keeper | None = None
) -> Run:
    """Make a run that the first Ctrl-C stops politely, and that goes on where the keeper's journal ends."""
    connection = session.connection
    stop = Event()
    interrupts.stop_politely(stop)
    address = node(target, connection.robot, connection.port)
    keeping = {"recorder": keeper, "earlier": keeper.earlier} if keeper else {}
    return Run(
        *(plan, session.link, connection.name, address, stop),
        reopen=session.reopen,
        on_step=session.tell,
        **keeping,  # type: ignore[arg-type]
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
