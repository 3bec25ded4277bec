"""``plan``: plan files go in, their contents and whether they are sound come out."""

import click

from sphero_probe.cli.complete.offers import offer_plans, offer_robots
from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output


@click.group("plan", context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """List, show and check probe plans (Python files that leave PLAN behind)."""


@command.command("list")
@output_options
def list_plans(output: Output) -> None:
    """List the plans that come with the tool.

    Example: sphero-probe plan list
    """
    from sphero_probe.probing.plans.loader import load_plan
    from sphero_probe.probing.plans.shipped import plan_files
    from sphero_probe.reports.rows import plan_row
    from sphero_probe.reports.views import PLANS

    plans = [(load_plan(file), file) for file in plan_files()]
    output.show(PLANS, (plan_row(plan.name, plan.summary, str(file), plan.robots) for plan, file in plans))


@command.command("show")
@click.argument("file", metavar="FILE | NAME", shell_complete=offer_plans)
@click.option(
    "--robot",
    "model",
    metavar="MODEL",
    help="As this robot understands the commands.",
    shell_complete=offer_robots,
)
@output_options
def show(output: Output, file: str, model: str | None) -> None:
    """Show the probes of a plan.

    Stages that are made from the answers are left out.

    Example: sphero-probe plan show power
    """
    from sphero_probe.catalogue import ROBOTS, robot_by_word
    from sphero_probe.cli.parse import choose
    from sphero_probe.link.policy import Consent
    from sphero_probe.probing.dry_run import planned_probes
    from sphero_probe.probing.plans.shipped import find_plan
    from sphero_probe.reports.rows import planned_row
    from sphero_probe.reports.views import PLANNED

    plan = find_plan(file)
    word = model or (plan.robots[0] if plan.robots else "bolt-plus")
    robot = robot_by_word(word) or ROBOTS[choose(word, ROBOTS, "robot")]
    output.show(PLANNED, map(planned_row, planned_probes(plan, robot.generation, robot, Consent(), None)))


@command.command("check")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", shell_complete=offer_plans)
def check(files: tuple[str, ...]) -> None:
    """Check that plan files can be loaded and hold probes.

    Example: sphero-probe plan check my_plan.py
    """
    from sphero_probe.errors import BadInputFileError, SpheroProbeError
    from sphero_probe.probing.plans.loader import probes_of
    from sphero_probe.probing.plans.shipped import find_plan

    broken: list[SpheroProbeError] = []
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
