"""``report``: print a recorded run."""

from sphero_probe.cli.output import show
from sphero_probe.cli.run import row_of
from sphero_probe.cli.values import Output
from sphero_probe.errors import BadInputFileError
from sphero_probe.probing.finding import Finding
from sphero_probe.reports.views import FINDING, FINDINGS
from sphero_probe.runs.record_stream import RecordStream
from sphero_probe.runs.store import find_journal


def show_run(output: Output, run: str) -> None:
    """Show the records of a journal.

    Args:
        output: where and how.
        run: a journal file, a run name, or ``last``.

    Raises:
        BadInputFileError: there is no such run, or its journal cannot be read.
    """
    with RecordStream(find_journal(run)) as stream:
        if stream.opening is None:
            raise BadInputFileError(f"{stream.path}: this journal is still empty")
        records = stream.records()
        if stream.opening.command in ("send", "led"):
            show(output, FINDING, (row_of(record) for record in records if isinstance(record, Finding)))
        else:
            show(output, FINDINGS, map(row_of, records))
