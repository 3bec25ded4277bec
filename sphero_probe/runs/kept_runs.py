"""Choose recorded runs by robot, model, firmware, outcome, tag and date."""

from collections.abc import Iterator
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

from sphero_probe.errors import BadInputFileError
from sphero_probe.runs.overview import Overview, read_overview
from sphero_probe.runs.store import journal_files
from sphero_probe.runs.tags import tags_of


class KeptRun(NamedTuple):
    """A run in the folder of journals.

    Attributes:
        path: its journal.
        overview: what the journal says; None if it is damaged.
        tags: its tags.
        problem: what is wrong with the journal, or empty.
    """

    path: Path
    overview: Overview | None
    tags: tuple[str, ...]
    problem: str = ""

    @property
    def robot(self) -> str:
        """The robot's name, empty if it is not known."""
        return self.overview.opening.device if self.overview and self.overview.opening else ""

    @property
    def started(self) -> datetime | None:
        """When the run started, in UTC; None if the journal does not tell."""
        heading = self.overview.heading if self.overview else None
        try:
            told = datetime.fromisoformat(heading.started) if heading else None
        except ValueError:
            return None
        return told if told is None or told.tzinfo else told.replace(tzinfo=UTC)


class RunFilter(NamedTuple):
    """Which runs are meant; a run must match all that is given.

    Attributes:
        robot: a pattern for the robot's name, ``BP-*``; letter case does not matter.
        model: the model's key or name, ``bolt-plus``.
        firmware: a pattern for the version of any node, ``4.*``.
        complete: whether the run was finished; None for either.
        tags: words that the run must be tagged with.
        since: the earliest start.
        until: starts before this.
    """

    robot: str = ""
    model: str = ""
    firmware: str = ""
    complete: bool | None = None
    tags: tuple[str, ...] = ()
    since: datetime | None = None
    until: datetime | None = None

    def accepts(self, run: KeptRun) -> bool:
        """Whether a run matches; a damaged journal matches only if nothing is asked for."""
        if self == RunFilter():
            return True
        if run.overview is None or not set(self.tags) <= set(run.tags):
            return False
        heading, opening = run.overview.heading, run.overview.opening
        models = {opening.robot if opening else "", *([heading.robot, heading.model] if heading else [])}
        versions = heading.firmware.values() if heading else ()
        return (
            (not self.robot or fnmatchcase(run.robot.lower(), self.robot.lower()))
            and (not self.model or self.model.lower() in {model.lower() for model in models})
            and (not self.firmware or any(fnmatchcase(version, self.firmware) for version in versions))
            and (self.complete is None or self.complete is run.overview.complete)
            and self._accepts_date(run.started)
        )

    def _accepts_date(self, started: datetime | None) -> bool:
        if self.since is None and self.until is None:
            return True
        return (
            started is not None
            and (self.since is None or started >= self.since)
            and (self.until is None or started < self.until)
        )


def kept_runs(wanted: RunFilter | None = None) -> Iterator[KeptRun]:
    """Yield the runs in the folder of journals, the last written first.

    Args:
        wanted: which; None for all.

    Raises:
        BadInputFileError: the folder cannot be read.
    """
    for path in journal_files():
        run = kept_run(path)
        if wanted is None or wanted.accepts(run):
            yield run


def kept_run(path: Path) -> KeptRun:
    """Return what is known of the run of a journal, which may be damaged."""
    try:
        return KeptRun(path, read_overview(path), tags_of(path))
    except BadInputFileError as error:
        return KeptRun(path, None, tags_of(path), str(error))
