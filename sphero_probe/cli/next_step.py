"""Suggests what to do with a run that is complete."""

import shlex
import sys
from itertools import islice
from pathlib import Path
from typing import Final

from sphero_probe.cli.messages import say
from sphero_probe.cli.values import Output
from sphero_probe.errors import SpheroProbeError
from sphero_probe.probing.finding import Heading
from sphero_probe.runs.overview import read_overview
from sphero_probe.runs.store import LAST, journal_files, runs_folder, slug

_LOOKED_AT: Final = 8
"""Journals that are opened to find an earlier run."""


def suggest_next(journal: Path | None, heading: Heading | None, output: Output) -> None:
    """Print a command that shows the run, and one that compares it with an earlier run if there is one.

    Nothing is printed unless both standard streams are terminals.

    Args:
        journal: of the run, None if none is kept.
        heading: of the run.
        output: where and how it was reported.
    """
    if journal is None or heading is None or not (sys.stdout.isatty() and sys.stderr.isatty()):
        return
    try:
        is_last = journal.parent == runs_folder()
        earlier = _earlier(journal, heading)
    except SpheroProbeError:  # a suggestion is no reason to fail
        return
    name = LAST if is_last else str(journal)
    if output.format != "html":
        _suggest("report", name, "-o", "map.html")
    if earlier:
        _suggest("diff", earlier.stem, name)


def _suggest(*words: str) -> None:
    say(f"next: {shlex.join(['sphero-probe', *words])}", limit=None)


def _earlier(journal: Path, heading: Heading) -> Path | None:
    """Return the last complete run of the same robot with the same plan, None if there is none.

    Raises:
        SpheroProbeError: a folder cannot be read.
    """
    ending = f"-{slug(heading.device)}-{slug(heading.plan)}"
    others = (path for path in journal_files() if path != journal and ending in path.stem)
    for path in islice(others, _LOOKED_AT):
        try:
            overview = read_overview(path)
        except SpheroProbeError:
            continue
        opening = overview.opening
        if opening and overview.complete and (opening.device, opening.plan) == (heading.device, heading.plan):
            return path
    return None
