"""The format ``plain``: one tab-separated line per row, for ``cut``, ``grep`` and ``awk``.

Nothing is cut. There is no header, unless the style asks for one. A line has the record columns of the view,
in the view's order (see ``views``); unknown values are empty. Rows of other types are left out.
"""

from functools import partial
from typing import TextIO

from sphero_probe.reports.printable import visible
from sphero_probe.reports.record_lines import RecordLines
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View


class TabSeparated:
    """Writes the view's rows as they arrive."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._out = out
        self._view = view
        self._lines = RecordLines(view, "\t", partial(visible, limit=None, unicode=style.unicode))
        if style.header:
            out.write(self._lines.header() + "\n")

    def add(self, row: Row) -> None:
        """Write a line."""
        if row.type == self._view.type:
            self._out.write(self._lines.of(row) + "\n")

    def close(self) -> None:
        """Nothing is left to write."""


def report(out: TextIO, *, view: View, style: Style) -> TabSeparated:
    """Open a report in this format."""
    return TabSeparated(out, view, style)
