"""``plan list`` and ``plan check``: list the shipped plans, and check that plans can be loaded."""

import click

from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.errors import BadInputFileError
from sphero_probe.probing.plans.loader import load_plan, probes_of
from sphero_probe.probing.plans.shipped import find_plan, plan_files
from sphero_probe.reports.rows import plan_row
from sphero_probe.reports.views import PLANS


def list_plans(output: Output) -> None:
    """List the plans that come with the tool.

    Args:
        output: where and how.
    """
    plans = [(load_plan(file), file) for file in plan_files()]
    show(output, PLANS, (plan_row(plan.name, plan.summary, str(file), plan.robots) for plan, file in plans))


def check_plans(files: tuple[str, ...]) -> None:
    """Load each plan and print how many probes it holds.

    Args:
        files: plan files, or names of plans that come with the tool.

    Raises:
        BadInputFileError: at least one cannot be loaded; the others were printed.
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
        more = (
            f", {later} stage{'s' * (later > 1)} that depend{'s' * (later == 1)} on findings" if later else ""
        )
        click.echo(f"{file}: ok, {probes} probe{'s' * (probes != 1)}{more}")
    if len(broken) == 1:
        raise broken[0]
    if broken:
        raise BadInputFileError("; ".join(str(error) for error in broken))
