"""The options of ``report``."""

from functools import partial

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import DOCUMENTS, SORTS, Output


@click.command("report", cls=StrictCommand)
@click.argument("run", metavar="RUN", shell_complete=offer("runs"))
@click.option("--only", metavar="OUTCOMES", help="Only these outcomes: exists,silent.")
@click.option(
    "--did", metavar="IDS", help="Only these devices: 0x13, 0x10-0x1a,power.", shell_complete=offer("dids")
)
@click.option(
    "--node", metavar="NODE", help="Only this node: primary, 0x12, none.", shell_complete=offer("nodes")
)
@click.option("--unknown", is_flag=True, help="Only commands that no catalogue knows.")
@click.option(
    "--sort", type=click.Choice(SORTS), help="Order of the findings; rtt starts with the slowest answer."
)
@click.option(
    "--as",
    "document",
    type=click.Choice(DOCUMENTS),
    help="protocol: write a reference of the robot's commands, in Markdown.",
)
@partial(output_options, detail=True)
def command(
    output: Output,
    run: str,
    only: str | None,
    did: str | None,
    node: str | None,
    unknown: bool,
    sort: str | None,
    document: str | None,
) -> None:
    """Print a recorded run in any format.

    RUN is a journal file, a run name, "last", or the file that -o map.json or -o map.jsonl wrote. The options
    choose and sort its findings.

    Example: sphero-probe report last --only exists,silent --format html -o map.html
    """
    from sphero_probe.cli.actions.report import ReportOptions, show_run

    show_run(output, run, ReportOptions(only, did, node, unknown, sort or "", document))
