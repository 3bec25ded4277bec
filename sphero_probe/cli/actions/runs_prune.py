"""``runs prune``: remove old runs."""

import time
from datetime import timedelta

from sphero_probe.cli.actions.runs import row_of_run
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.reports.views import RUNS
from sphero_probe.runs.kept_runs import kept_runs
from sphero_probe.runs.prune import removable, remove


def prune_runs(output: Output, keep: int, older_than: timedelta | None, *, dry_run: bool) -> None:
    """Remove old runs, and list them.

    Args:
        output: where and how.
        keep: how many of the last written runs stay.
        older_than: the age from which on a run may go, None for any.
        dry_run: remove nothing.

    Raises:
        BadInputFileError: the folder cannot be read.
        OutputError: a run cannot be removed.
    """
    runs = list(kept_runs())
    age = older_than.total_seconds() if older_than else 0.0
    old = list(removable(runs, keep=keep, older_than=age, now=time.time()))
    gone = old if dry_run else [run for run in old if remove(run)]
    show(output, RUNS, map(row_of_run, gone))
    say(f"{'Would remove' if dry_run else 'Removed'} {len(gone)} of {len(runs)} runs.")
