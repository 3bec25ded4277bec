"""``plan show``: print the probes of a plan. Separate from ``plan list``, which needs no asyncio."""

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.naming import choose
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.link.policy import Consent
from sphero_probe.probing.dry_run import planned_probes
from sphero_probe.probing.plans.shipped import find_plan
from sphero_probe.reports.rows import planned_row
from sphero_probe.reports.views import PLANNED


def show_plan(output: Output, file: str, model: str | None) -> None:
    """Show the probes of a plan, as far as they are known before a run.

    Args:
        output: where and how.
        file: the plan's file, or the name of one that comes with the tool.
        model: the robot to show them for; None for the first one that the plan names.

    Raises:
        BadInputFileError: there is no such plan, or it cannot be loaded.
        UsageError: no robot has this name.
    """
    plan = find_plan(file)
    word = model or (plan.robots[0] if plan.robots else "bolt-plus")
    robot = robot_by_word(word) or ROBOTS[choose(word, ROBOTS, "robot")]
    probes = planned_probes(plan, robot.generation, robot, Consent(), None)
    show(output, PLANNED, map(planned_row, probes))
