"""The results of a run, from this process or from a journal file."""

from pathlib import Path
from typing import NamedTuple

from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Summary
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.store import find_journal


class Run(NamedTuple):
    """The results of a run.

    Attributes:
        heading: the robot and the plan; None before the run has started.
        findings: one per probe, in the order of the probes.
        notes: other observations: notifications, late responses, malformed frames, calibration.
        summary: counts and duration; None for a run that did not end.
    """

    heading: Heading | None = None
    findings: tuple[Finding, ...] = ()
    notes: tuple[Note, ...] = ()
    summary: Summary | None = None

    @property
    def complete(self) -> bool:
        """Whether all probes were sent."""
        return self.summary is not None and self.summary.complete

    @property
    def existing(self) -> tuple[Finding, ...]:
        """The findings of the commands that exist."""
        return tuple(finding for finding in self.findings if finding.outcome is Outcome.EXISTS)

    def find(self, name: str) -> Finding | None:
        """Return the last finding about a command, by its name in the catalogue, or None."""
        found = (finding for finding in reversed(self.findings) if finding.name == name)
        return next(found, None)


def load_run(path: Path | str) -> Run:
    """Return the run in a journal; an incomplete last line is skipped.

    Args:
        path: the journal's file; or a run name or ``last``, as in ``sphero-probe report``.

    Raises:
        BadInputFileError: there is no such run, or the file is not a journal.
    """
    recorded = read_journal(find_journal(str(path)))
    return Run(
        heading=recorded.headings[-1] if recorded.headings else None,
        findings=tuple(recorded.findings[number] for number in sorted(recorded.findings)),
        notes=tuple(record for record in recorded.records() if isinstance(record, Note)),
        summary=recorded.summary,
    )
