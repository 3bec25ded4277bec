"""The subcommands of ``plan`` and their options."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.group("plan", context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """List, show and check probe plans (Python files that define PLAN)."""


@command.command("list", cls=StrictCommand)
@output_options
def list_(output: Output) -> None:
    """List the plans that come with the tool.

    Example: sphero-probe plan list
    """
    from sphero_probe.cli.actions.plan import list_plans

    list_plans(output)


@command.command("show", cls=StrictCommand)
@click.argument("file", metavar="FILE | NAME", shell_complete=offer("plans"))
@click.option(
    "--robot",
    "model",
    metavar="MODEL",
    help="Show what this model would be sent.",
    shell_complete=offer("robots"),
)
@output_options
def show(output: Output, file: str, model: str | None) -> None:
    """Show the probes of a plan.

    Stages that depend on findings are left out.

    Example: sphero-probe plan show power
    """
    from sphero_probe.cli.actions.plan_show import show_plan

    show_plan(output, file, model)


@command.command("check", cls=StrictCommand)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", shell_complete=offer("plans"))
def check(files: tuple[str, ...]) -> None:
    """Load plan files and report errors.

    Example: sphero-probe plan check my_plan.py
    """
    from sphero_probe.cli.actions.plan import check_plans

    check_plans(files)
