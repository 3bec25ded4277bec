"""Renders the record columns of rows, those that many rows share only once."""

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import Column, View

_MOST: Final = 1024
"""The most patterns that are remembered."""


class _Pattern(NamedTuple):
    """The cells of rows that share most of their data.

    Attributes:
        cells: one per column; those that vary are empty.
        varying: place and column of each cell that varies.
        shared: what the rows share; it is kept, so that its id stays its own.
    """

    cells: list[str]
    varying: list[tuple[int, Column]]
    shared: Mapping[str, object]


class RecordCells:
    """Renders the cells of a view's record columns."""

    def __init__(self, view: View, escape: Callable[[str], str]) -> None:
        """Render for one format.

        Args:
            view: the columns.
            escape: the raw text of a cell -> what the format writes.
        """
        self._columns = view.record_columns
        self._escape = escape
        self._patterns: dict[tuple[int, tuple[str, ...]], _Pattern] = {}

    def of(self, row: Row) -> list[str]:
        """Return the cells of a row, as the format writes them."""
        escape, data = self._escape, row.data
        if not row.shared:
            texts = [column.render(data) for column in self._columns]
            return [text if text.isalnum() and text.isascii() else text and escape(text) for text in texts]
        key = (id(row.shared), tuple(data))
        pattern = self._patterns.get(key)
        if pattern is None:
            if len(self._patterns) >= _MOST:
                self._patterns.clear()
            pattern = self._patterns[key] = self._pattern(row)
        cells = pattern.cells.copy()
        for at, column in pattern.varying:
            cells[at] = escape(column.render(data))
        return cells

    def _pattern(self, row: Row) -> _Pattern:
        """Tell apart the columns whose key is shared or absent: a record column depends on no other row."""
        cells, varying = [], []
        for at, column in enumerate(self._columns):
            varies = column.key in row.data and column.key not in row.shared
            cells.append("" if varies else self._escape(column.render(row.data)))
            if varies:
                varying.append((at, column))
        return _Pattern(cells, varying, row.shared)
