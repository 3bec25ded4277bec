"""The page of a run in Markdown: what was executed by surprise, the robot, the differences, the findings."""

from typing import Final

from sphero_probe.probing.notes import EXECUTED
from sphero_probe.reports import sweep_sections as words
from sphero_probe.reports.differences import differences
from sphero_probe.reports.finding_line import FindingLine
from sphero_probe.reports.markdown_page import MarkdownPage
from sphero_probe.reports.phrases import remarked, shown
from sphero_probe.reports.run_blocked import blocked_by_reason
from sphero_probe.reports.run_heading import calibration_lines, heading_lines
from sphero_probe.reports.sweep_sections import Section

_CROWD: Final = 32
"""Findings of a section above which only their ids are listed, where the section allows it."""
_TITLES: Final = ("", "Node", "DID:CID", "Name", "State", "ms")
_RIGHT: Final = (False, False, False, False, False, True)


class MarkdownRun(MarkdownPage):
    """Collects the rows of a run and writes the page at the end."""

    def close(self) -> None:
        """Write the page."""
        rows, selection = self._rows, self._view.selection
        lines = rows.lines(in_order=bool(selection.sort))
        places = words.places(lines)
        apart = rows.heading is None or len(places) > 1
        if rows.heading:
            who = f"{shown(rows.heading.get('model'))} {shown(rows.heading.get('device'))}"
            self._writer.heading(1, f"Commands of {self._safe(who)}")
        for note in rows.notes_of(EXECUTED):
            self._writer.paragraph(f"**Executed:** {self._safe(shown(note.get('text')))}")
        if rows.heading:
            calibration = calibration_lines(rows.notes, rows.robot)
            told = heading_lines(rows.heading, places, calibration)
            told += [f"Nodes: {shown(rows.survey.get('text'))}"] if rows.survey else []
            self._writer.items(map(self._safe, told))
        for note in rows.notes_of("comparison"):
            self._writer.heading(2, "Differences from the robot's own list and the catalogue")
            self._named(differences(note))
        for section in words.sections(lines, rows.robot, selection):
            self._writer.heading(2, self._safe(section.title))
            if section.crowd and len(section.lines) > _CROWD:
                self._named(words.crowds(section.lines, apart=apart))
            else:
                cells = [self._cells(line, section, apart=apart) for line in section.lines]
                self._writer.table(_TITLES, cells, _RIGHT)
        if told_blocked := blocked_by_reason(lines, self._times, apart=apart):
            self._writer.heading(2, "Blocked: these were not sent")
            self._named(told_blocked)
        self._end(lines)

    def _cells(self, line: FindingLine, section: Section, *, apart: bool) -> tuple[str, ...]:
        name = words.short_name(line, section.title)
        return (
            line.mark,
            self._safe(line.node) if apart else "",
            self._code(line.pair),
            name if line.name is None else self._code(name),
            self._safe(remarked(line.says, line.remark)),
            "" if line.rtt_ms is None else f"{line.rtt_ms:.1f}",
        )

    def _named(self, told: list[tuple[str, list[str]]]) -> None:
        """Write a list of titles, each with its ids."""
        self._writer.items(
            f"{self._safe(what)}: {self._code(', '.join(ids), limit=None)}" for what, ids in told
        )

    def _end(self, lines: list[FindingLine]) -> None:
        rows = self._rows
        closing = [
            *rows.selected,
            *words.doubts(lines),
            *words.remarks(rows.remarks, self._times),
            *rows.other_nodes,
        ]
        absent = "" if self._view.selection.filters else words.not_shown(lines, self._times)
        closing += [absent] if absent else []
        closing += [words.ending(rows.summary, lines)] if rows.summary else []
        closing += rows.troubles()
        if not (closing or rows.heading or lines):
            closing.append(self._view.empty)
        if closing:
            if rows.heading or lines:
                self._writer.heading(2, "End of the run")
            self._writer.items(map(self._safe, closing))
