"""A run with all that it found: of this process, or read from a journal file."""

from pathlib import Path
from typing import NamedTuple

from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Summary
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.store import find_journal


class Run(NamedTuple):
    """What a run found.

    Attributes:
        heading: which robot was asked what; None while nothing was asked.
        findings: one per probe, in the order of the probes.
        notes: what was seen besides: notifications, late answers, malformed frames, calibration.
        summary: counts and duration; None for a run that was cut off.
    """

    heading: Heading | None = None
    findings: tuple[Finding, ...] = ()
    notes: tuple[Note, ...] = ()
    summary: Summary | None = None

    @property
    def complete(self) -> bool:
        """Whether everything was asked."""
        return self.summary is not None and self.summary.complete

    @property
    def existing(self) -> tuple[Finding, ...]:
        """The findings of the commands that exist."""
        return tuple(finding for finding in self.findings if finding.outcome is Outcome.EXISTS)

    def find(self, name: str) -> Finding | None:
        """Return the last finding on a command by its catalogue name, None where there is none."""
        found = (finding for finding in reversed(self.findings) if finding.name == name)
        return next(found, None)


def load_run(path: Path | str) -> Run:
    """Return the run that a journal holds; a torn last line is skipped.

    Args:
        path: the journal's file, or as ``sphero-probe report`` takes it: a name in the folder of runs,
            ``last``.

    Raises:
        BadInputFileError: there is no such run, or the file is no journal.
    """
    recorded = read_journal(find_journal(str(path)))
    return Run(
        heading=recorded.headings[-1] if recorded.headings else None,
        findings=tuple(recorded.findings[number] for number in sorted(recorded.findings)),
        notes=tuple(record for record in recorded.records() if isinstance(record, Note)),
        summary=recorded.summary,
    )
