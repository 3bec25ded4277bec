"""The options of ``matrix``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.run_options import run_filter_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output, RunChoice


@click.command("matrix", cls=StrictCommand)
@click.argument("what", metavar="DEVICE | COMMAND...", nargs=-1, required=True, shell_complete=offer("what"))
@run_filter_options
@output_options
def command(output: Output, chosen: RunChoice, what: tuple[str, ...]) -> None:
    """Compare commands across robots and firmware, over all recorded runs.

    A row is a command, a column a model with its firmware. Commands that some robots have and others do not
    come first. "+" is a command that exists, "-" one that is absent.

    Example: sphero-probe matrix power
    """
    from sphero_probe.cli.actions.matrix import show_matrix

    show_matrix(output, what, chosen)
