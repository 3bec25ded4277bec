"""Makes the rows of the list of runs, one per journal file."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from sphero_probe.probing.finding import Heading, Outcome
from sphero_probe.reports.rows import Row, counts_by_word
from sphero_probe.runs.decode import Opening


def run_file_row(
    file: Path,
    opening: Opening | None = None,
    heading: Heading | None = None,
    counts: Mapping[Outcome, int] | None = None,
    complete: bool = False,
    *,
    problem: str = "",
    tags: Iterable[str] = (),
) -> Row:
    """Return the row of a journal; of a broken one, little more than the ``problem`` is known."""
    return Row(
        "run_file",
        {
            "when": heading.started if heading else None,
            "robot": opening.device if opening else None,
            "model": heading.model if heading else None,
            "command": opening.command if opening else None,
            "plan": opening.plan if opening else None,
            "counts": counts_by_word(counts or {}),
            "complete": complete,
            "file": str(file),
            "problem": problem or None,
            "tags": list(tags),
            "firmware": dict(heading.firmware) if heading else {},
        },
    )
