"""The options of ``diff``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.command("diff", cls=StrictCommand)
@click.argument("before", metavar="A", shell_complete=offer("runs"))
@click.argument("after", metavar="B", shell_complete=offer("runs"))
@click.option(
    "--values", is_flag=True, help="Compare all values of answers, also volatile ones and of two robots."
)
@output_options
def command(output: Output, before: str, after: str, values: bool) -> None:
    """Compare two runs, or a run with what is known.

    Each of A and B is a run (a name, a journal file or "last"), a report in JSON that -o wrote, "catalogue"
    (what is known of the other side's model), fake:MODEL (all that its firmware has; nothing is sent), or the
    address of a robot (its own list of commands; nothing else is asked of it).

    Commands are matched by node, DID and CID: appeared, disappeared, another answer, another length, another
    value, risk or name. A command that one side blocked, did not ask or found inconclusive is not compared.
    Values that change by themselves, such as a battery level, are left out, and so are all values of two
    robots.

    Exit code: 0 no difference, 1 differences, 2 trouble.

    Example: sphero-probe diff 'fake:bolt?seed=1' 'fake:bolt?seed=2&hidden=5'
    """
    from sphero_probe.cli.actions.diff import show_diff

    show_diff(output, before, after, values=values)
