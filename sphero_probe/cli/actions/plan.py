"""``plan``: list, show and check plan files."""

import click

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.cli.output import show
from sphero_probe.cli.parse import choose
from sphero_probe.cli.values import Output
from sphero_probe.errors import BadInputFileError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.dry_run import planned_probes
from sphero_probe.probing.plans.loader import load_plan, probes_of
from sphero_probe.probing.plans.shipped import find_plan, plan_files
from sphero_probe.reports.rows import plan_row, planned_row
from sphero_probe.reports.views import PLANNED, PLANS


def list_plans(output: Output) -> None:
    """List the plans that come with the tool.

    Args:
        output: where and how.
    """
    plans = [(load_plan(file), file) for file in plan_files()]
    show(output, PLANS, (plan_row(plan.name, plan.summary, str(file), plan.robots) for plan, file in plans))


def show_plan(output: Output, file: str, model: str | None) -> None:
    """Show the probes of a plan, as far as they are known before a run.

    Args:
        output: where and how.
        file: the plan's file, or the name of one that comes with the tool.
        model: the robot that understands the commands; None for the plan's own.

    Raises:
        BadInputFileError: there is no such plan, or it cannot be loaded.
        UsageError: no robot is called so.
    """
    plan = find_plan(file)
    word = model or (plan.robots[0] if plan.robots else "bolt-plus")
    robot = robot_by_word(word) or ROBOTS[choose(word, ROBOTS, "robot")]
    probes = planned_probes(plan, robot.generation, robot, Consent(), None)
    show(output, PLANNED, map(planned_row, probes))


def check_plans(files: tuple[str, ...]) -> None:
    """Load each plan and print how many probes it holds.

    Args:
        files: plan files, or names of plans that come with the tool.

    Raises:
        BadInputFileError: at least one cannot be loaded; the others are printed.
    """
    broken: list[BadInputFileError] = []
    for file in files:
        try:
            plan = find_plan(file)
            probes = sum(len(probes_of(plan, stage, ())) for stage in plan.stages if not callable(stage))
        except BadInputFileError as error:
            broken.append(error)
            continue
        later = sum(callable(stage) for stage in plan.stages)
        more = f", {later} stage(s) made from the answers" if later else ""
        click.echo(f"{file}: ok, {probes} probes{more}")
    if len(broken) == 1:
        raise broken[0]
    if broken:
        raise BadInputFileError("; ".join(str(error) for error in broken))
