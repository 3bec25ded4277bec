"""The format ``table``: a page for people, written when all rows have arrived."""

from typing import Final, TextIO

from sphero_probe.reports.registry import Report, Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.terminal import Shape, TerminalWriter
from sphero_probe.reports.views import FINDINGS, View

_LEGEND: Final = 16
"""Lines of a legend that are shown."""


class ListTable:
    """Collects the view's rows and writes them at the end, without empty columns."""

    def __init__(self, out: TextIO, view: View, style: Style, writer: TerminalWriter | None = None) -> None:
        self._writer = writer or TerminalWriter(out, style)
        self._view = view
        self._rows: list[tuple[str, ...]] = []
        self._legend: dict[str, None] = {}
        below = view.below if view.below and view.below.heading else None
        self._below = ListTable(out, below, style, self._writer) if below else None

    def add(self, row: Row) -> None:
        """Keep a row of the view's type, or of the view below it."""
        if self._below:
            self._below.add(row)
        if row.type == self._view.type:
            self._rows.append(tuple(column.render(row.data) for column in self._view.table_columns))
            self._legend.update(dict.fromkeys(self._view.legend(row.data)))

    def close(self) -> None:
        """Write the page."""
        self._write()
        if self._below:
            self._below.write_below()
        self._writer.flush()

    def write_below(self) -> None:
        """Write the list under its heading below another one, if it has rows."""
        if self._rows:
            self._writer.skip()
            self._writer.say(self._view.heading, "bold")
            self._write()

    def _write(self) -> None:
        if not self._rows:
            self._writer.say(self._view.empty)
        elif self._view.upright:
            self._upright()
        else:
            self._grid()

    def _grid(self) -> None:
        columns = self._view.table_columns
        kept = [at for at in range(len(columns)) if any(row[at] for row in self._rows)]
        shapes = [Shape(columns[at].title, columns[at].right, columns[at].whole) for at in kept]
        rows = [tuple(row[at] for at in kept) for row in self._rows]
        self._writer.grid(shapes, rows, self._writer.widths(shapes, rows))
        if self._legend:
            self._writer.skip()
        lines = sorted(self._legend)
        for line in lines[:_LEGEND]:
            self._writer.say(line)
        if len(lines) > _LEGEND:
            self._writer.say(f"and {len(lines) - _LEGEND} more")

    def _upright(self) -> None:
        titles = [column.title for column in self._view.table_columns]
        shapes = (Shape("", whole=True, look="bold"), Shape(""))
        pages = [[pair for pair in zip(titles, row, strict=True) if pair[1]] for row in self._rows]
        widths = self._writer.widths(shapes, [pair for page in pages for pair in page])
        for page in pages:
            self._writer.skip()
            self._writer.grid(shapes, page, widths, heading=False)


def report(out: TextIO, *, view: View, style: Style) -> Report:
    """Open a report in this format."""
    if view.type == FINDINGS.type and not view.upright:
        from sphero_probe.reports.formats.sweep_table import SweepTable  # noqa: PLC0415 - lists do without asyncio

        return SweepTable(out, view, style)
    if view.type == "node":
        from sphero_probe.reports.formats.nodes_table import NodesTable  # noqa: PLC0415 - likewise

        return NodesTable(out, style, view.empty)
    if view.type == "difference":
        from sphero_probe.reports.formats.diff_table import DiffTable  # noqa: PLC0415 - likewise

        return DiffTable(out, style)
    if view.below and not view.below.heading:
        from sphero_probe.reports.formats.fleet_table import FleetTable  # noqa: PLC0415 - likewise

        return FleetTable(ListTable(out, view, style), ListTable(out, view.below, style), out, style)
    return ListTable(out, view, style)
