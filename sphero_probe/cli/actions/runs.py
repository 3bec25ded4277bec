"""``runs``: list the recorded runs."""

from pathlib import Path

from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.errors import BadInputFileError
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_files import run_file_row
from sphero_probe.reports.views import RUNS
from sphero_probe.runs.overview import read_overview
from sphero_probe.runs.store import journal_files


def list_runs(output: Output) -> None:
    """List the runs in the folder of journals, newest first.

    Args:
        output: where and how.

    Raises:
        BadInputFileError: the folder cannot be read.
    """
    show(output, RUNS, map(_row, journal_files()))


def _row(path: Path) -> Row:
    try:
        return run_file_row(*read_overview(path))
    except BadInputFileError as error:
        return run_file_row(path, problem=str(error))
