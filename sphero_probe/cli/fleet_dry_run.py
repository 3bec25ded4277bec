"""Shows what a plan would send to each robot of a fleet, without connecting to any."""

from collections.abc import Callable, Iterable, Sequence

from sphero_probe.cli.dry_run import count_of, say_dry_run, what_follows
from sphero_probe.cli.fleet_robots import chosen_robots
from sphero_probe.cli.fleet_troubles import listed_troubles
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import FleetConnectOptions, Output
from sphero_probe.errors import IncompleteError, RefusedByPolicyError
from sphero_probe.fleet.dry_run import PlannedRobot, Planner, planned_fleet
from sphero_probe.fleet.on_robot import FleetConsent
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.reports.fleet_planned import FLEET_PLANNED, planned_robot_row, withheld_rows

PlannerFor = Callable[[Sequence[FleetRobot]], Planner]
"""Makes the action, once the robots are known."""


def show_fleet_dry_run(
    command: str,
    output: Output,
    connecting: FleetConnectOptions,
    action_for: PlannerFor,
    consent: FleetConsent,
) -> None:
    """Show how many probes each robot would get and which are blocked; ``--all`` scans for the robots.

    Args:
        command: the name of the single command that does the same.
        output: where and how to print.
        connecting: which robots.
        action_for: makes the action.
        consent: what is allowed.

    Raises:
        RefusedByPolicyError: a robot would be refused.
        IncompleteError: the plan cannot be made for another one.
        SpheroProbeError: the robots cannot be found.
    """
    planned: list[PlannedRobot] = []

    async def plan() -> None:
        robots = await chosen_robots(connecting)
        planned.extend(planned_fleet(robots, action_for(robots), consent))

    run_interruptible(Interrupts(), plan())
    say_dry_run("each robot")
    with report(output, FLEET_PLANNED) as rows:
        for one in planned:
            rows.add(planned_robot_row(one))
        for row in withheld_rows(planned):
            rows.add(row)
    _say_total(planned, command)
    _check(planned)


def _say_total(planned: Iterable[PlannedRobot], command: str) -> None:
    known = [one.planned for one in planned if one.error is None]
    if not known:
        return
    sent = sum(sum(one.sent.values()) for one in known)
    count = count_of(sent, sum(len(one.blocked) for one in known))
    stages = tuple(dict.fromkeys(name for one in known for name in one.following))
    many = f"{len(known)} robot{'s' * (len(known) != 1)}"
    say(f"{many}: {'; '.join(filter(None, (count, what_follows(stages) if stages else '')))}.")
    say(f"The bytes for one robot: sphero-probe {command} --dry-run --device ROBOT, with the same options.")


def _check(planned: Sequence[PlannedRobot]) -> None:
    """Check that a run would begin on every robot, as far as its model is known.

    Raises:
        RefusedByPolicyError: a robot would be refused.
        IncompleteError: the plan cannot be made for another one.
    """
    errors = [(one.robot.name, one.error) for one in planned if one.error and one.subject.robot]
    if not errors:
        return
    refused = [(name, error) for name, error in errors if isinstance(error, RefusedByPolicyError)]
    listed = listed_troubles([(name, str(error)) for name, error in refused or errors])
    kind = RefusedByPolicyError if refused else IncompleteError
    what = "would be refused" if refused else "cannot be asked"
    many = f"{len(refused or errors)} of {len(planned)} robots"
    raise kind(f"{many} {what}: {listed}", (refused or errors)[0][1].hint)
