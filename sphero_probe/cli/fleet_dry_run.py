"""Shows what a plan would send to each robot of a fleet, without connecting to any."""

from collections.abc import Iterable, Sequence
from typing import Final

from sphero_probe.cli.dry_run import count_of, say_dry_run, what_follows
from sphero_probe.cli.fleet_robots import chosen_robots
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import FleetConnectOptions, Output
from sphero_probe.errors import IncompleteError, RefusedByPolicyError
from sphero_probe.fleet.dry_run import PlannedRobot, planned_fleet
from sphero_probe.fleet.on_robot import FleetConsent
from sphero_probe.fleet.plans import PlanAction
from sphero_probe.reports.fleet_planned import FLEET_PLANNED, planned_robot_row, withheld_rows

_NAMED: Final = 4
"""Robots that a message names."""


def show_fleet_dry_run(
    output: Output, connecting: FleetConnectOptions, action: PlanAction, consent: FleetConsent
) -> None:
    """Show how many probes each robot would get and which are blocked; ``--all`` scans for the robots.

    Args:
        output: where and how to print.
        connecting: which robots.
        action: makes the plan.
        consent: what is allowed.

    Raises:
        RefusedByPolicyError: a robot would be refused.
        IncompleteError: the plan cannot be made for another one.
        SpheroProbeError: the robots cannot be found.
    """
    planned: list[PlannedRobot] = []

    async def plan() -> None:
        planned.extend(planned_fleet(await chosen_robots(connecting), action, consent))

    say_dry_run("each robot")
    run_interruptible(Interrupts(), plan())
    with report(output, FLEET_PLANNED) as rows:
        for one in planned:
            rows.add(planned_robot_row(one))
        for row in withheld_rows(planned):
            rows.add(row)
    _say_total(planned, action.command)
    _check(planned)


def listed_troubles(troubles: Sequence[tuple[str, str]]) -> str:
    """Return the first robots with their troubles, and how many more there are.

    Args:
        troubles: the name and the trouble of each.
    """
    named = [f"{name} ({trouble})" for name, trouble in troubles[:_NAMED]]
    more = [f"and {len(troubles) - _NAMED} more"] if len(troubles) > _NAMED else []
    return ", ".join((*named, *more))


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
    """Check that a run would begin on every robot.

    Raises:
        RefusedByPolicyError: a robot would be refused.
        IncompleteError: the plan cannot be made for another one.
    """
    errors = [(one.robot.name, one.error) for one in planned if one.error]
    refused = [(name, error) for name, error in errors if isinstance(error, RefusedByPolicyError)]
    if not errors:
        return
    listed = listed_troubles([(name, str(error)) for name, error in refused or errors])
    kind = RefusedByPolicyError if refused else IncompleteError
    what = "would be refused" if refused else "cannot be asked"
    raise kind(
        f"{len(refused or errors)} of {len(planned)} robots {what}: {listed}", (refused or errors)[0][1].hint
    )
