"""Remove old runs from the folder of journals."""

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress

from sphero_probe.errors import InUseError, OutputError, SpheroProbeError
from sphero_probe.json_files import FLAGS, why
from sphero_probe.runs.kept_runs import KeptRun
from sphero_probe.runs.lock import lock
from sphero_probe.runs.tags import tags_file


def removable(
    runs: Iterable[KeptRun], *, keep: int, older_than: float = 0.0, now: float
) -> Iterator[KeptRun]:
    """Yield the runs that may be removed.

    Never the last run of a robot, nor a tagged run, a damaged journal, or one that a process writes.

    Args:
        runs: all runs, the last written first.
        keep: how many of the last written runs stay.
        older_than: seconds since the last write from which on a run may go.
        now: seconds since the epoch.
    """
    robots: set[str] = set()
    for place, run in enumerate(runs):
        is_last = run.robot not in robots
        robots.add(run.robot)
        if is_last or place < keep or run.tags or run.overview is None:
            continue
        with suppress(OSError):
            if now - run.path.stat().st_mtime >= older_than and not _is_in_use(run):
                yield run


def remove(run: KeptRun) -> bool:
    """Remove the journal of a run and its tags.

    Returns:
        Whether it is gone: False if a process has begun to write it.

    Raises:
        OutputError: it cannot be removed.
    """
    try:
        if _is_in_use(run):
            return False
        run.path.unlink()
        tags_file(run.path).unlink(missing_ok=True)
    except FileNotFoundError:
        return True
    except OSError as error:
        raise OutputError(f"cannot remove {run.path}: {why(error)}") from error
    return True


def _is_in_use(run: KeptRun) -> bool:
    """Whether a process writes this journal."""
    descriptor = os.open(run.path, os.O_RDWR | FLAGS)
    try:
        lock(descriptor, run.path)
    except InUseError:
        return True
    except SpheroProbeError:  # it cannot be locked, as on some network drives
        return False
    finally:
        os.close(descriptor)
    return False
