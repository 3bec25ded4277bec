"""``fleet``: run one action on many robots, report each, and compare them."""

import asyncio
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import aclosing
from typing import NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.cli.actions.discover import plan_of as discovery_plan
from sphero_probe.cli.actions.led import wanted_leds
from sphero_probe.cli.actions.sweep import SweepOptions
from sphero_probe.cli.fleet_dry_run import show_fleet_dry_run
from sphero_probe.cli.fleet_plans import ANY, sweep_plans
from sphero_probe.cli.fleet_progress import fleet_progress
from sphero_probe.cli.fleet_robots import chosen_robots, fleet_for
from sphero_probe.cli.fleet_troubles import RESUME, check_results
from sphero_probe.cli.messages import say, warn
from sphero_probe.cli.output import report
from sphero_probe.cli.run import row_of
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import FleetAskOptions, FleetConnectOptions, FleetJournalOptions, Output
from sphero_probe.errors import InterruptedRunError, UsageError
from sphero_probe.fleet.action import Action
from sphero_probe.fleet.health import HealthAction
from sphero_probe.fleet.lights import LedAction, colours_of
from sphero_probe.fleet.on_robot import FleetConsent, RobotOptions
from sphero_probe.fleet.plans import INCOMPLETE, PlanAction, Subject
from sphero_probe.fleet.records import Ended, FleetRecord
from sphero_probe.fleet.results import RobotResult
from sphero_probe.fleet.resume import EarlierRun, earlier_runs
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.link.policy import Consent
from sphero_probe.probing.finding import Finding, Heading, Note, Summary
from sphero_probe.probing.plan import Plan
from sphero_probe.reports.fleet import FLEET, FleetMatrix, robot_result_row
from sphero_probe.reports.run_ending import RunEnding
from sphero_probe.runs.resume import RunJournal

Results = dict[str, RobotResult]
"""Robot name -> its result, in the order of the fleet."""


class Asked(NamedTuple):
    """What a fleet is asked to do.

    Attributes:
        action_for: makes the action, once the robots are known.
        consent: what may be sent.
        timeout: seconds until a command counts as silent, None to measure it.
        journal: which journals to keep.
        compare: compare the robots command by command.
        matrix: formats with one list write that comparison.
    """

    action_for: Callable[[Sequence[FleetRobot]], Action]
    consent: FleetConsent = FleetConsent()
    timeout: float | None = None
    journal: FleetJournalOptions = FleetJournalOptions(off=True)
    compare: bool = False
    matrix: bool = False


def fleet_health(output: Output, connecting: FleetConnectOptions) -> None:
    """Check each robot, and report how well it works.

    Args:
        output: where and how to report.
        connecting: which robots, and how to connect.

    Raises:
        SpheroProbeError: as ``run_fleet`` does.
    """
    run_fleet(output, connecting, Asked(lambda _: HealthAction()))


def fleet_sweep(
    output: Output,
    journal: FleetJournalOptions,
    connecting: FleetConnectOptions,
    asking: FleetAskOptions,
    options: SweepOptions,
    *,
    matrix: bool,
) -> None:
    """Probe ranges or a plan on each robot, and compare the robots.

    Args:
        output: where and how to report.
        journal: which journals to keep.
        connecting: which robots, and how to connect.
        asking: what is allowed, and of which node.
        options: what to ask.
        matrix: formats with one list write the comparison.

    Raises:
        SpheroProbeError: the options are not valid, or as ``run_fleet`` does.
    """
    action = PlanAction("sweep", sweep_plans(options), asking.target)
    _run_plan(output, journal, connecting, asking, action, matrix=matrix)


def fleet_discover(
    output: Output,
    journal: FleetJournalOptions,
    connecting: FleetConnectOptions,
    asking: FleetAskOptions,
    options: Mapping[str, str],
    *,
    matrix: bool,
) -> None:
    """Map each robot, and compare the robots.

    Args:
        output: where and how to report.
        journal: which journals to keep.
        connecting: which robots, and how to connect.
        asking: what is allowed, and of which node.
        options: of ``discover``, as a journal keeps them.
        matrix: formats with one list write the comparison.

    Raises:
        SpheroProbeError: the options are not valid, or as ``run_fleet`` does.
    """

    def plan_for(subject: Subject) -> tuple[Plan, dict[str, str]]:
        return discovery_plan(subject.generation, subject.target, dict(options)), dict(options)

    plan_for(ANY)  # a mistake in the options shows before anything is connected
    action = PlanAction("discover", plan_for, asking.target)
    _run_plan(output, journal, connecting, asking, action, matrix=matrix)


def _run_plan(
    output: Output,
    journal: FleetJournalOptions,
    connecting: FleetConnectOptions,
    asking: FleetAskOptions,
    action: PlanAction,
    *,
    matrix: bool,
) -> None:
    """Run a plan on each robot, or show what it would send.

    Raises:
        SpheroProbeError: as ``run_fleet`` and ``show_fleet_dry_run`` do.
    """
    if not asking.dry_run:
        asked = Asked(
            *(lambda _: action, _consent(asking), asking.timeout, journal), compare=True, matrix=matrix
        )
        run_fleet(output, connecting, asked)
        return
    if journal.resume or matrix:
        raise UsageError(f"--dry-run cannot be combined with {'--resume' if journal.resume else '--matrix'}")
    show_fleet_dry_run(action.command, output, connecting, lambda _: action, _consent(asking))


def fleet_led(
    output: Output,
    journal: FleetJournalOptions,
    connecting: FleetConnectOptions,
    asking: FleetAskOptions,
    front: str | None,
    back: str | None,
    leds: tuple[str, ...],
    *,
    off: bool,
) -> None:
    """Light each robot in another colour, or set the named LEDs on all.

    Args:
        output: where and how to report.
        journal: which journals to keep.
        connecting: which robots, and how to connect.
        asking: what is allowed besides setting LEDs, and which node.
        front: the colour of the front LED, None to leave it alone.
        back: of the back LED.
        leds: further ones, each ``NAME=RRGGBB``.
        off: switch off every LED that is not named.

    Raises:
        SpheroProbeError: the options are not valid, or as ``run_fleet`` does.
    """
    wanted = wanted_leds(front, back, leds)

    def action_for(robots: Sequence[FleetRobot]) -> LedAction:
        colours = None if wanted or off else colours_of(robots)
        return LedAction(colours, wanted, off, asking.target)

    consent = _consent(asking, Risk.WRITE)
    if asking.dry_run:
        show_fleet_dry_run("led", output, connecting, action_for, consent)
        return
    run_fleet(output, connecting, Asked(action_for, consent, asking.timeout, journal))


def run_fleet(
    output: Output, connecting: FleetConnectOptions, asked: Asked, results: Results | None = None
) -> None:
    """Run an action on each robot, show progress, and report the robots; also after a signal.

    Args:
        output: where and how to report.
        connecting: which robots, and how to connect.
        asked: what to do.
        results: is filled, also if the run ends early.

    Raises:
        IncompleteError: a robot has no complete result.
        RefusedByPolicyError: a robot was refused.
        InterruptedRunError: a signal ended the run.
        SpheroProbeError: the robots cannot be found.
    """
    interrupts = Interrupts()
    results = {} if results is None else results
    compared = FleetMatrix()
    endings: defaultdict[str, RunEnding] = defaultdict(RunEnding)

    async def work() -> None:
        robots = await chosen_robots(connecting)
        action = asked.action_for(robots)
        earlier = _earlier(robots, action, asked)
        results.update((robot.name, RobotResult(robot)) for robot in robots)
        stop = asyncio.Event()
        interrupts.stop_politely(stop)
        options = RobotOptions(asked.consent, connecting.connect_timeout, asked.timeout, connecting.tolerate)
        finished = {name: run.journal for name, run in earlier.items() if run.complete}

        def journal_for(robot: FleetRobot) -> RunJournal:
            run = earlier.get(robot.name)
            resume = str(run.journal) if run else None
            off = asked.journal.off or not action.command
            return RunJournal(action.command, off=off, resume=resume, on_warning=warn)

        fleet = await fleet_for(
            connecting, robots, action, journal_for, options=options, stop=stop, finished=finished
        )
        with fleet_progress(results, output.color) as show:
            async with aclosing(fleet.records()) as records:
                async for robot, record in records:
                    name = robot.name
                    if isinstance(record, Heading | Finding | Note | Summary) and asked.compare:
                        row = row_of(record)
                        compared.add(name, row)
                        endings[name].add(row)
                    results[name].add(_explained(record, endings[name]))
                    show(results[name])

    resumable = asked.compare and not asked.journal.off
    try:
        run_interruptible(interrupts, work())
    except InterruptedRunError:
        if resumable and any(result.reached for result in results.values()):
            say(RESUME)
        raise
    finally:
        if results:
            _report(output, results, compared, matrix=asked.matrix)
    check_results(results, resumable=resumable)


def _consent(asking: FleetAskOptions, *also: Risk) -> FleetConsent:
    return FleetConsent(Consent.of(asking.allow, "", *also).allowed, frozenset(asking.confirm))


def _earlier(robots: Sequence[FleetRobot], action: Action, asked: Asked) -> dict[str, EarlierRun]:
    if not (asked.journal.resume and isinstance(action, PlanAction)):
        return {}
    return earlier_runs(robots, action, Consent(asked.consent.allowed))


def _report(output: Output, results: Results, compared: FleetMatrix, *, matrix: bool) -> None:
    comparison = compared.compared(results)
    view = comparison.view if matrix and output.format != "table" else FLEET._replace(below=comparison.view)
    with report(output, view) as rows:
        for result in results.values():
            rows.add(robot_result_row(result))
        for row in comparison.rows():
            rows.add(row)


def _explained(record: FleetRecord, ending: RunEnding) -> FleetRecord:
    """Return the record; its trouble becomes the reasons for it, and the commands that dropped the link."""
    if not isinstance(record, Ended):
        return record
    troubles = ending.reasons if record.trouble == INCOMPLETE else (record.trouble,)
    return record._replace(trouble="; ".join(filter(None, (*troubles, ending.dropped))))
