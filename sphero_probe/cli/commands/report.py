"""The options of ``report``."""

from functools import partial

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.command("report", cls=StrictCommand)
@click.argument("run", metavar="RUN", shell_complete=offer("runs"))
@partial(output_options, detail=True)
def command(output: Output, run: str) -> None:
    """Print a recorded run in any format.

    RUN is a journal file, a run name, or "last".

    Example: sphero-probe report last --format table
    """
    from sphero_probe.cli.actions.report import show_run

    show_run(output, run)
