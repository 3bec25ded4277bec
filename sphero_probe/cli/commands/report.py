"""``report``: the journal of a run goes in, its report comes out again."""

import click

from sphero_probe.cli.complete.offers import offer_runs
from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output


@click.command("report")
@click.argument("run", metavar="RUN", shell_complete=offer_runs)
@output_options
def command(output: Output, run: str) -> None:
    """Show a run again, in any format.

    RUN is a journal: its file, its name in the list of runs, or last.

    Example: sphero-probe report last --format table
    """
    from sphero_probe.cli.run import row_of
    from sphero_probe.errors import BadInputFileError
    from sphero_probe.probing.finding import Finding
    from sphero_probe.reports.views import FINDING, FINDINGS
    from sphero_probe.runs.reader import read_journal
    from sphero_probe.runs.store import find_journal

    recorded = read_journal(find_journal(run))
    if recorded.opening is None:
        raise BadInputFileError(f"{recorded.path}: nothing is written in it yet")
    records = recorded.records()
    if recorded.opening.command in ("send", "led"):
        output.show(FINDING, (row_of(record) for record in records if isinstance(record, Finding)))
    else:
        output.show(FINDINGS, map(row_of, records))
