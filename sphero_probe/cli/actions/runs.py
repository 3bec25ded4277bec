"""``runs``: list the recorded runs, and tag them."""

from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output, RunChoice
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_files import run_file_row
from sphero_probe.reports.views import RUNS
from sphero_probe.runs.kept_runs import KeptRun, RunFilter, kept_run, kept_runs
from sphero_probe.runs.store import find_journal
from sphero_probe.runs.tags import check_tag, tags_of, write_tags


def list_runs(output: Output, chosen: RunChoice) -> None:
    """List the runs in the folder of journals, newest first.

    Args:
        output: where and how.
        chosen: which.

    Raises:
        BadInputFileError: the folder cannot be read.
    """
    show(output, RUNS, map(row_of_run, kept_runs(filter_of(chosen))))


def tag_run(output: Output, run: str, words: tuple[str, ...], *, remove: bool) -> None:
    """Tag a run, and show it.

    Args:
        output: where and how.
        run: a journal file, a run name, or ``last``.
        words: the tags.
        remove: take them away.

    Raises:
        UsageError: a word is no tag.
        BadInputFileError: there is no such run.
        OutputError: the tags cannot be written.
    """
    tags = {check_tag(word) for word in words}
    path = find_journal(run)
    earlier = set(tags_of(path))
    write_tags(path, earlier - tags if remove else earlier | tags)
    show(output, RUNS, [row_of_run(kept_run(path))])


def filter_of(chosen: RunChoice) -> RunFilter:
    """Return the filter that the options describe."""
    complete = None if chosen.outcome is None else chosen.outcome == "complete"
    return RunFilter(
        chosen.robot, chosen.model, chosen.firmware, complete, chosen.tags, chosen.since, chosen.until
    )


def row_of_run(run: KeptRun) -> Row:
    """Return the row of a run."""
    if run.overview is None:
        return run_file_row(run.path, problem=run.problem, tags=run.tags)
    return run_file_row(*run.overview, tags=run.tags)
