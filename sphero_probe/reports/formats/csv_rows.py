"""The format ``csv``: a header and one record per row, for spreadsheets (RFC 4180, lines end in LF).

The header names the keys of the rows. Rows of other types than the view's are left out.
"""

import csv
from typing import TextIO

from sphero_probe.reports.printable import csv_cell
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View


class CommaSeparated:
    """Writes the view's rows as they arrive, after the header."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._writer = csv.writer(out, lineterminator="\n")
        self._view = view
        self._style = style
        self._headed = False

    def add(self, row: Row) -> None:
        """Write a record."""
        if row.type == self._view.type:
            self._head()
            cells = (column.render(row.data) for column in self._view.record_columns)
            self._writer.writerow([csv_cell(cell, unicode=self._style.unicode) for cell in cells])

    def close(self) -> None:
        """Write the header if there was no record."""
        self._head()

    def _head(self) -> None:
        if not self._headed:
            self._headed = True
            self._writer.writerow([column.key for column in self._view.record_columns])


def report(out: TextIO, *, view: View, style: Style) -> CommaSeparated:
    """Open a report in this format."""
    return CommaSeparated(out, view, style)
