"""The format ``csv``: a header and one record per row, for spreadsheets (RFC 4180, lines end in LF).

The header names the keys of the rows. Rows of other types than the view's are left out.
"""

from functools import partial
from typing import TextIO

from sphero_probe.reports.printable import csv_cell
from sphero_probe.reports.record_lines import RecordLines
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View


class CommaSeparated:
    """Writes the view's rows as they arrive, after the header."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._out = out
        self._view = view
        self._lines = RecordLines(view, ",", partial(_quoted, unicode=style.unicode))
        self._headed = False

    def add(self, row: Row) -> None:
        """Write a record."""
        if row.type == self._view.type:
            self._head()
            self._out.write(self._lines.of(row) + "\n")

    def close(self) -> None:
        """Write the header if there was no record."""
        self._head()

    def _head(self) -> None:
        if not self._headed:
            self._headed = True
            self._out.write(self._lines.header() + "\n")


def _quoted(text: str, *, unicode: bool) -> str:
    """Return a cell, in quotes where RFC 4180 wants them; the module csv would check every cell again."""
    cell = csv_cell(text, unicode=unicode)
    if "," in cell or '"' in cell:
        return '"' + cell.replace('"', '""') + '"'
    return cell


def report(out: TextIO, *, view: View, style: Style) -> CommaSeparated:
    """Open a report in this format."""
    return CommaSeparated(out, view, style)
