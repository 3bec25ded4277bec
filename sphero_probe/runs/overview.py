"""Read what a list of runs shows of each: the head and the tail of its journal, not all that lies between."""

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import parse, why
from sphero_probe.probing.finding import Heading, Outcome, Summary
from sphero_probe.runs.decode import Entry, Opening, decode
from sphero_probe.runs.reader import Recorded, check_size, open_to_read, read_journal
from sphero_probe.runs.store import journal_files

_HEAD: Final = 1 << 13
_TAIL: Final = 1 << 12
"""Bytes that hold the first two lines of a journal, and the last; longer ones are read as a whole."""
_ENDS: Final = 3
"""Pieces that two ends of lines leave."""


class Overview(NamedTuple):
    """What a list shows of a run.

    Attributes:
        path: the journal.
        opening: its first line; None if nothing is written.
        heading: what the robot was when the run started, None if it never came to that.
        counts: outcome -> number of findings.
        complete: whether the run was finished.
    """

    path: Path
    opening: Opening | None
    heading: Heading | None
    counts: Mapping[Outcome, int]
    complete: bool


def read_overview(path: Path) -> Overview:
    """Return what a list shows of a journal.

    Damage between head and tail is not noticed. A journal without a summary at its end is read as a whole.

    Raises:
        BadInputFileError: it cannot be read, or is not a journal of this tool.
    """
    descriptor = open_to_read(path)
    try:
        size = check_size(descriptor, path)
        head = os.read(descriptor, _HEAD)
        os.lseek(descriptor, max(0, size - _TAIL), os.SEEK_SET)
        tail = os.read(descriptor, _TAIL)
    except OSError as error:
        raise BadInputFileError(f"{path}: {why(error)}") from error
    finally:
        os.close(descriptor)
    return _from_ends(path, head, tail) or _from_all(read_journal(path))


def last_to_resume(command: str) -> Path | None:
    """Return the journal of the last unfinished run of a command; if all are finished, that of the last one.

    Journals that cannot be read are left out. None if there is no run of the command.

    Args:
        command: the command that the run must be of: ``sweep``, ``discover``.
    """
    finished = None
    for path in journal_files():
        with suppress(BadInputFileError):
            run = read_overview(path)
            if run.opening and run.opening.command == command:
                if not run.complete:
                    return path
                finished = finished or path
    return finished


def _from_ends(path: Path, head: bytes, tail: bytes) -> Overview | None:
    """Return what head and tail say; None if that is not enough."""
    lines, ending = head.split(b"\n", 2), tail.split(b"\n")
    if len(lines) < 3 or len(ending) < 3 or ending[-1]:
        return None
    try:
        opening = decode(parse(lines[0]), None)
        heading = _decoded(lines[1], opening)
        summary = _decoded(ending[-2], opening)
    except BadLineError:  # reading it as a whole tells which line
        return None
    if isinstance(opening, Opening) and isinstance(heading, Heading) and isinstance(summary, Summary):
        return Overview(path, opening, heading, summary.counts, summary.complete)
    return None


def _decoded(line: bytes, opening: Entry) -> Entry:
    if not isinstance(opening, Opening):
        raise BadLineError("does not start like a journal")
    return decode(parse(line), opening)


def _from_all(recorded: Recorded) -> Overview:
    heading = recorded.headings[0] if recorded.headings else None
    return Overview(recorded.path, recorded.opening, heading, recorded.counts, recorded.complete)
