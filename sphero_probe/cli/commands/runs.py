"""``runs``: the folder of journals goes in, a list of what was run comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from pathlib import Path

    from sphero_probe.reports.rows import Row


@click.command("runs")
@output_options
def command(output: Output) -> None:
    """List the runs whose journals are kept, the last one first.

    Example: sphero-probe runs --json
    """
    from sphero_probe.reports.views import RUNS
    from sphero_probe.runs.store import journal_files

    output.show(RUNS, map(_row, journal_files()))


def _row(path: "Path") -> "Row":
    from sphero_probe.errors import BadInputFileError
    from sphero_probe.reports.run_files import run_file_row
    from sphero_probe.runs.reader import read_journal

    try:
        recorded = read_journal(path)
    except BadInputFileError as error:
        return run_file_row(path, problem=str(error))
    heading = recorded.headings[0] if recorded.headings else None
    return run_file_row(path, recorded.opening, heading, recorded.counts, complete=recorded.complete)
