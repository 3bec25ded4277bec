"""The format ``plain``: one tab-separated line per row, for ``cut``, ``grep`` and ``awk``.

Nothing is cut. There is no header, unless the style asks for one. A line has the record columns of the view,
in the view's order (see ``views``); unknown values are empty. Rows of other types are left out.
"""

from functools import partial
from typing import TextIO

from sphero_probe.reports.printable import visible
from sphero_probe.reports.record_cells import RecordCells
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View


class TabSeparated:
    """Writes the view's rows as they arrive."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._out = out
        self._view = view
        self._cells = RecordCells(view, partial(visible, limit=None, unicode=style.unicode))
        if style.header:
            keys = (column.key for column in view.record_columns)
            out.write("\t".join(visible(key, limit=None, unicode=style.unicode) for key in keys) + "\n")

    def add(self, row: Row) -> None:
        """Write a line."""
        if row.type == self._view.type:
            self._out.write("\t".join(self._cells.of(row)) + "\n")

    def close(self) -> None:
        """Nothing is left to write."""


def report(out: TextIO, *, view: View, style: Style) -> TabSeparated:
    """Open a report in this format."""
    return TabSeparated(out, view, style)
