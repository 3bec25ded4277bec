"""The options of ``runs``."""

import click

from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.command("runs", cls=StrictCommand)
@output_options
def command(output: Output) -> None:
    """List the recorded runs, newest first.

    Example: sphero-probe runs --json
    """
    from sphero_probe.cli.actions.runs import list_runs

    list_runs(output)
