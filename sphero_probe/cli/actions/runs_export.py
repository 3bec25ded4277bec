"""``runs export``: write runs into one SQLite file."""

from pathlib import Path

from sphero_probe.cli.actions.runs import filter_of
from sphero_probe.cli.messages import say
from sphero_probe.cli.values import RunChoice
from sphero_probe.errors import BadInputFileError
from sphero_probe.reports.sqlite_file import runs_file
from sphero_probe.runs.kept_runs import kept_runs
from sphero_probe.runs.record_stream import RecordStream


def export_runs(file: str, chosen: RunChoice) -> None:
    """Write runs into an SQLite file; damaged journals are named and left out.

    Args:
        file: its path; a file of this name is replaced.
        chosen: which runs.

    Raises:
        BadInputFileError: the folder of runs cannot be read.
        OutputError: the file cannot be written.
    """
    written, names = 0, set[str]()
    with runs_file(Path(file)) as exported:
        for run in kept_runs(filter_of(chosen)):
            if run.overview is None:
                say(f"left out: {run.problem}")
                continue
            name = run.path.stem if run.path.stem not in names else str(run.path)
            names.add(name)
            try:
                with RecordStream(run.path) as stream:
                    if stream.opening:
                        complete = run.overview.complete
                        exported.add(name, stream.opening, stream.records(), run.tags, complete=complete)
                        written += 1
            except BadInputFileError as error:
                say(f"left out: {error}")
    say(f"{file}: {written} runs")
