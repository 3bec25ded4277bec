"""The format ``md``: Markdown for an issue or a wiki, written when all rows have arrived."""

from typing import TextIO

from sphero_probe.reports.markdown_text import MarkdownWriter, safe
from sphero_probe.reports.registry import Report, Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import COMMANDS, FINDINGS, Column, View


class MarkdownList:
    """Collects the view's rows and writes them at the end as a table."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._writer = MarkdownWriter(out)
        self._view = view
        self._style = style
        self._rows: list[list[str]] = []
        self._below = MarkdownList(out, view.below, style) if view.below and view.below.heading else None

    def add(self, row: Row) -> None:
        """Keep a row of the view's type, or of the view below it."""
        if self._below:
            self._below.add(row)
        if row.type == self._view.type:
            self._rows.append([self._cell(column, row) for column in self._view.table_columns])

    def _cell(self, column: Column, row: Row) -> str:
        return safe(column.render(row.data), limit=None, unicode=self._style.unicode)

    def close(self) -> None:
        """Write the page."""
        titles = [column.title for column in self._view.table_columns]
        if not self._rows:
            self._writer.paragraph(self._view.empty)
        elif self._view.upright:
            for row in self._rows:
                pairs = [pair for pair in zip(titles, row, strict=True) if pair[1]]
                self._writer.table(("What", "Value"), pairs)
        else:
            self._writer.table(titles, self._rows, [column.right for column in self._view.table_columns])
        if self._below:
            self._writer.heading(2, self._below._view.heading)  # noqa: SLF001 - another of this class
            self._below.close()


def report(out: TextIO, *, view: View, style: Style) -> Report:
    """Open a report in this format."""
    if view.type == FINDINGS.type and view.document:
        from sphero_probe.reports.formats.markdown_protocol import ProtocolDocument  # noqa: PLC0415 - lists do without

        return ProtocolDocument(out, view, style)
    if view.type == FINDINGS.type and not view.upright:
        from sphero_probe.reports.formats.markdown_run import MarkdownRun  # noqa: PLC0415 - likewise

        return MarkdownRun(out, view, style)
    if view is COMMANDS:
        from sphero_probe.reports.formats.markdown_catalogue import MarkdownCatalogue  # noqa: PLC0415 - likewise

        return MarkdownCatalogue(out, view, style)
    if view.type == "difference":
        from sphero_probe.reports.formats.markdown_diff import MarkdownDiff  # noqa: PLC0415 - likewise

        return MarkdownDiff(out, style)
    return MarkdownList(out, view, style)
