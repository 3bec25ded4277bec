"""Where journals are kept: the names of robot and plan go in, a new file comes out, and those there are."""

import os
import re
from collections.abc import Mapping
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sphero_probe.errors import BadInputFileError, OutputError

if TYPE_CHECKING:
    from sphero_probe.runs.journal import Journal

LAST: Final = "last"
"""Stands for the journal that was written last."""
_SUFFIX: Final = ".jsonl"
_NOT_SLUG: Final = re.compile(r"[^a-z0-9]+")
_SLUG: Final = 40


def runs_folder(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the folder of the journals, below the XDG state directory; it need not exist.

    Raises:
        OutputError: nobody knows where the home is.
    """
    state = Path(environment.get("XDG_STATE_HOME", ""))
    try:
        base = state if state.is_absolute() else Path.home() / ".local" / "state"
    except RuntimeError as error:
        raise OutputError(f"no place for journals: {error}", "set XDG_STATE_HOME") from error
    return base / "sphero-probe" / "runs"


def slug(text: str) -> str:
    """Return a stranger's text as part of a file's name: ASCII letters, digits and dashes, at most 40."""
    return _NOT_SLUG.sub("-", text[:200].lower()).strip("-")[:_SLUG].strip("-")


def create_journal(robot: str, plan: str, *, now: datetime) -> "Journal":
    """Open a new journal in the folder.

    Args:
        robot: the robot's name.
        plan: the plan's name.
        now: the time in UTC, for the name.

    Raises:
        OutputError: it cannot be written.
    """
    from sphero_probe.runs.journal import Journal  # noqa: PLC0415 - brings asyncio, which listing does without

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
            except BadInputFileError:  # another run was quicker
                continue
    raise AssertionError("counting does not end")


def journal_files() -> list[Path]:
    """Return the journals in the folder, the last written first.

    Raises:
        OutputError: nobody knows where the folder is.
    """
    found: list[tuple[int, Path]] = []
    try:
        with os.scandir(runs_folder()) as entries:
            found.extend(
                (entry.stat().st_mtime_ns, Path(entry.path))
                for entry in entries
                if entry.name.endswith(_SUFFIX) and entry.is_file()
            )
    except FileNotFoundError:
        pass
    except OSError as error:
        raise BadInputFileError(f"{runs_folder()}: {error.strerror}") from error
    return [path for _, path in sorted(found, reverse=True)]


def find_journal(text: str) -> Path:
    """Return the file that a person means: a path, a name in the folder, or ``last``.

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
        named += [runs_folder() / text, runs_folder() / f"{text}{_SUFFIX}"]
    for path in named:
        try:
            if os.path.lexists(path):
                return path
        except ValueError:
            break
    raise BadInputFileError(f"{text}: no such run", "see: sphero-probe runs")
