"""Collects the rows of a run for a page that is written at the end."""

from typing import TYPE_CHECKING, Final

from sphero_probe.probing.finding import Outcome
from sphero_probe.probing.node_notes import SURVEY
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.reports.address_phrases import other_nodes
from sphero_probe.reports.finding_line import FindingLine, line_of, robot_of
from sphero_probe.reports.phrases import Data, shown
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_ending import RunEnding
from sphero_probe.transports.recordings import EXCHANGES

if TYPE_CHECKING:
    from sphero_probe.catalogue.model import Robot

_TOLD_ELSEWHERE: Final = ("calibration", "evidence", EXECUTED, SURVEY, "comparison", "selection", EXCHANGES)


class RunRows:
    """The rows of one run; rows of other types are left out.

    Most findings of a whole robot are absent commands that no catalogue knows. Their rows are not kept, so
    that a run of 65,536 findings needs little memory.

    Attributes:
        heading: the data of the run's row, None where there was none.
        robot: the model that it names, None if it is not known.
        notes: the data of all notes.
        summary: how the run ended the last time, None if it was cut off.
    """

    def __init__(self) -> None:
        self.heading: Data | None = None
        self.robot: Robot | None = None
        self.notes: list[Data] = []
        self.summary: Data | None = None
        self._ending = RunEnding()
        self._lines: dict[int | str, FindingLine] = {}
        self._rows: dict[int | str, Data] = {}

    def add(self, row: Row) -> None:
        """Keep a row."""
        self._ending.add(row)
        match row.type:
            case "run" if self.heading is None:
                self.heading, self.robot = row.data, robot_of(row.data)
            case "finding":
                self._keep(row.data)
            case "note":
                self.notes.append(row.data)
            case "summary":
                self.summary = row.data

    def _keep(self, data: Data) -> None:
        """Keep the last finding of a number: verification replaces what it verified."""
        number = data.get("number")
        key = number if isinstance(number, int) else f"without a number, {len(self._lines)}"
        line = line_of(data, self.robot)
        self._lines[key] = line
        if line.outcome == Outcome.ABSENT and line.name is None:
            self._rows.pop(key, None)
        else:
            self._rows[key] = data

    def lines(self, *, in_order: bool) -> list[FindingLine]:
        """Return the findings.

        Args:
            in_order: they arrived in the order in which they are shown; otherwise they are sorted by number.
        """
        lines = list(self._lines.values())
        return lines if in_order else sorted(lines, key=lambda line: line.number)

    def data(self, *, in_order: bool) -> list[tuple[FindingLine, Data | None]]:
        """Return the findings with their rows, None for absent commands that no catalogue knows."""
        pairs = [(line, self._rows.get(key)) for key, line in self._lines.items()]
        return pairs if in_order else sorted(pairs, key=lambda pair: pair[0].number)

    def notes_of(self, kind: str) -> list[Data]:
        """Return the notes of one kind."""
        return [note for note in self.notes if note.get("kind") == kind]

    @property
    def selected(self) -> list[str]:
        """How many findings are shown, empty where all are."""
        return [shown(note.get("text")) for note in self.notes_of("selection")]

    @property
    def survey(self) -> Data | None:
        """Which nodes the robot has; a resumed run has asked for them several times."""
        surveys = self.notes_of(SURVEY)
        return surveys[-1] if surveys else None

    @property
    def other_nodes(self) -> list[str]:
        """The nodes that answered in place of the one that was asked, in words."""
        return other_nodes(self._rows.values(), self.robot)

    @property
    def remarks(self) -> list[Data]:
        """The notes that have no place of their own on a page."""
        return [note for note in self.notes if note.get("kind") not in _TOLD_ELSEWHERE]

    def troubles(self) -> list[str]:
        """Return why the run is incomplete; empty where it is complete, or where it is no run."""
        if self.summary:
            partly = bool(self.selected)  # then the findings that say why may be left out
            why = "the whole report says why" if partly else "; ".join(self._ending.reasons)
            return [] if self.summary.get("complete") else [f"Incomplete: {why}."]
        cut_off = "Incomplete: the record of this run ends before the run did."
        return [cut_off] if self.heading else []
