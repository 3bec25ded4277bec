"""The table of a run: a page that leads with what was executed by surprise, then with what was found."""

from typing import Final, TextIO, TypeVar

from sphero_probe.probing.finding import Outcome
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.reports import sweep_sections as words
from sphero_probe.reports.differences import differences
from sphero_probe.reports.finding_line import Data, FindingLine
from sphero_probe.reports.nodes_page import write_nodes
from sphero_probe.reports.phrases import remarked, shown
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_blocked import blocked_by_class, blocked_by_reason
from sphero_probe.reports.run_heading import calibration_lines, heading_lines
from sphero_probe.reports.run_rows import RunRows
from sphero_probe.reports.sweep_sections import Section
from sphero_probe.reports.terminal import Shape, TerminalWriter
from sphero_probe.reports.views import View

_Part = TypeVar("_Part")
_CROWD: Final = 32
"""Findings of a section above which only their ids are shown, where the section allows it."""
_LINE: Final = 400
"""The most characters of a heading or a remark."""
_MARK: Final = Shape("", whole=True, look="bold green")
_NODE: Final = Shape("Node", whole=True)
_SHAPES: Final = (
    _MARK,
    _NODE,
    Shape("DID:CID", whole=True),
    Shape("Name"),
    Shape("State"),
    Shape("ms", right=True, whole=True, look="dim"),
)


class SweepTable:
    """Collects the rows of a run and writes the page at the end."""

    def __init__(self, out: TextIO, view: View, style: Style, *, brief: bool = False) -> None:
        """Open the page.

        Args:
            out: where it is written.
            view: which findings, and what it says without a row.
            style: what ``out`` can show.
            brief: write only what fits on one screen.
        """
        self._brief, self._detail = brief, style.detail
        self._writer = TerminalWriter(out, style)
        self._times = "\N{MULTIPLICATION SIGN}" if style.unicode else "x"
        self._view = view
        self._rows = RunRows()

    def add(self, row: Row) -> None:
        """Keep a row of a run; rows of other types are left out."""
        self._rows.add(row)

    def close(self) -> None:
        """Write the page."""
        rows, selection = self._rows, self._view.selection
        lines = rows.lines(in_order=bool(selection.sort))
        places = words.places(lines)
        apart = rows.heading is None or len(places) > 1
        self._overview(lines, places)
        if not self._brief:
            self._survey()
            self._sections(words.sections(lines, rows.robot, selection), apart=apart)
            self._blocked(lines, apart=apart)
            if not selection.filters:
                self._absent(lines)
        self._writer.flush()

    def _overview(self, lines: list[FindingLine], places: list[str]) -> None:
        """Write what fits on one screen: the robot, the counts, the differences, the troubles."""
        rows = self._rows
        executed = rows.notes_of(EXECUTED)
        for note in executed:
            self._writer.say(f"Executed: {shown(note.get('text'))}", "bold red", limit=_LINE)
        if executed:
            self._writer.skip()
        calibration = calibration_lines(rows.notes, rows.robot)
        who, *rest = heading_lines(rows.heading, places, calibration) if rows.heading else [""]
        if who:
            self._writer.say(who, "bold", limit=_LINE)
        self._counts(lines)
        for text in rest:
            self._writer.say(text, limit=_LINE)
        for text in (*words.doubts(lines), *words.remarks(rows.remarks, self._times), *rows.other_nodes):
            self._writer.say(text, limit=_LINE)
        self._differences(rows.notes_of("comparison"))

    def _counts(self, lines: list[FindingLine]) -> None:
        """Write the run in a sentence, why it is incomplete, and how many findings are shown."""
        rows = self._rows
        if rows.summary:
            self._writer.say(words.ending(rows.summary, lines), "bold")
        elif not (rows.heading or lines or rows.notes):
            self._writer.say(self._view.empty)
        for text in rows.troubles():
            self._writer.say(text, "bold yellow")
        for text in rows.selected:
            self._writer.say(text)

    def _survey(self) -> None:
        """Write which nodes the robot has."""
        survey = self._rows.survey
        system, nodes = (survey.get(key) for key in ("system", "nodes")) if survey else (None, None)
        if isinstance(system, dict) and isinstance(nodes, list):
            self._writer.skip()
            self._writer.say("Nodes", "bold")
            write_nodes(self._writer, system, [node for node in nodes if isinstance(node, dict)])

    def _sections(self, sections: list[Section], *, apart: bool) -> None:
        """Write the sections; their grids share the columns and one row of titles."""
        marked = any(line.mark for section in sections for line in section.lines)
        wanted = [(shape is not _MARK or marked) and (shape is not _NODE or apart) for shape in _SHAPES]
        shapes = _picked(_SHAPES, wanted)
        grids = [
            [] if _crowded(section) else [_picked(_cells(line, section), wanted) for line in section.lines]
            for section in sections
        ]
        widths = self._writer.widths(shapes, [row for grid in grids for row in grid])
        if any(grids):
            self._writer.skip()
            self._writer.grid(shapes, [], widths)
        for at, (section, grid) in enumerate(zip(sections, grids, strict=True)):
            if at or not any(grids):
                self._writer.skip()
            self._writer.say(section.title, "bold")
            if grid:
                self._writer.grid(shapes, grid, widths, heading=False)
            else:
                self._named(words.crowds(section.lines, apart=apart))

    def _differences(self, notes: list[Data]) -> None:
        """Write how the findings differ from the robot's own list and the catalogue, or from a library."""
        for note in notes:
            self._writer.skip()
            source = shown(note.get("claimed_by")) or "the robot's own list and the catalogue"
            self._writer.say(f"Differences from {source}", "bold")
            self._named(differences(note))

    def _blocked(self, lines: list[FindingLine], *, apart: bool) -> None:
        """Write what was not sent: a line for each class, or with ``detail`` each reason and its commands."""
        if not any(line.outcome == Outcome.SKIPPED for line in lines):
            return
        self._writer.skip()
        if self._detail:
            self._writer.say("Blocked: these were not sent", "bold")
            self._named(blocked_by_reason(lines, self._times, apart=apart))
        else:
            self._writer.say("Blocked: not sent (--detail lists each command and the reason)", "bold")
            for text in blocked_by_class(lines, self._times, apart=apart):
                self._writer.say(text, indent=2)

    def _named(self, told: list[tuple[str, list[str]]]) -> None:
        for what, ids in told:
            self._writer.say(f"{what}:", indent=2)
            self._writer.items(ids, indent=6)

    def _absent(self, lines: list[FindingLine]) -> None:
        if absent := words.not_shown(lines, self._times):
            self._writer.skip()
            self._writer.say(absent, limit=_LINE)


def _cells(line: FindingLine, section: Section) -> tuple[str, ...]:
    return (
        line.mark,
        line.node,
        line.pair,
        words.short_name(line, section.title),
        remarked(line.says, line.remark),
        "" if line.rtt_ms is None else f"{line.rtt_ms:.1f}",
    )


def _crowded(section: Section) -> bool:
    return section.crowd and len(section.lines) > _CROWD


def _picked(parts: tuple[_Part, ...], wanted: list[bool]) -> tuple[_Part, ...]:
    return tuple(part for part, want in zip(parts, wanted, strict=True) if want)
