"""Manage the folder of journals: create a file for a new run, list journals, find one by name."""

import os
import re
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sphero_probe.errors import BadInputFileError, InUseError, OutputError
from sphero_probe.runs.folders import former_state_folder, state_folder

if TYPE_CHECKING:
    from sphero_probe.runs.journal import Journal

LAST: Final = "last"
"""Names the journal that was written last."""
_RUNS: Final = "runs"
_SUFFIX: Final = ".jsonl"
_NOT_SLUG: Final = re.compile(r"[^a-z0-9]+")
_SLUG: Final = 40


def runs_folder() -> Path:
    """Return the folder of journals; it may not exist yet.

    Raises:
        OutputError: the home folder is not known.
    """
    try:
        return state_folder() / _RUNS
    except RuntimeError as error:
        raise OutputError(f"no place for journals: {error}", "set XDG_STATE_HOME") from error


def _folders() -> list[Path]:
    """Return the folders that may hold runs: today's first, then that of earlier versions."""
    former = former_state_folder()
    return [runs_folder(), *([former / _RUNS] if former else [])]


def slug(text: str) -> str:
    """Return an untrusted text as part of a file name: ASCII letters, digits and dashes, at most 40."""
    return _NOT_SLUG.sub("-", text[:200].lower()).strip("-")[:_SLUG].strip("-")


def create_journal(robot: str, plan: str, *, now: datetime) -> "Journal":
    """Create a journal in the folder of runs.

    Args:
        robot: the robot's name.
        plan: the plan's name.
        now: the time in UTC, for the file name.

    Raises:
        OutputError: it cannot be written.
    """
    from sphero_probe.runs.journal import Journal  # noqa: PLC0415 - imports asyncio, which listing does not need

    folder = runs_folder()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}") from error
    stem = "-".join((now.strftime("%Y%m%dT%H%M%SZ"), slug(robot) or "robot", slug(plan) or "plan"))
    for turn in count(1):
        path = folder / (stem + (f"-{turn}" if turn > 1 else "") + _SUFFIX)
        if not os.path.lexists(path):
            try:
                return Journal.create(path)
            except InUseError:  # another run took this name
                continue
    raise AssertionError("counting does not end")


def journal_files() -> list[Path]:
    """Return all journals, the last written first.

    Raises:
        OutputError: the home folder is not known.
        BadInputFileError: a folder cannot be read.
    """
    found = [entry for folder in _folders() for entry in _journals_in(folder)]
    return [path for _, path in sorted(found, reverse=True)]


def _journals_in(folder: Path) -> list[tuple[int, Path]]:
    """Return the time of the last write, in ns, and the path of each journal."""
    try:
        with os.scandir(folder) as entries:
            return [
                (entry.stat().st_mtime_ns, Path(entry.path))
                for entry in entries
                if entry.name.endswith(_SUFFIX) and entry.is_file()
            ]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise BadInputFileError(f"{folder}: {error.strerror}") from error


def find_journal(text: str) -> Path:
    """Return the journal that the user means: a path, a name in the list of runs, or ``last``.

    Raises:
        BadInputFileError: there is none.
    """
    if text == LAST:
        files = journal_files()
        if not files:
            raise BadInputFileError("no run is kept yet", "each sweep, send and led keeps one")
        return files[0]
    named = [Path(text)]
    if Path(text).name == text:
        named += [folder / name for folder in _folders() for name in (text, f"{text}{_SUFFIX}")]
    for path in named:
        try:
            if os.path.lexists(path):
                return path
        except ValueError:
            break
    raise BadInputFileError(f"{text}: no such run", "see: sphero-probe runs")
