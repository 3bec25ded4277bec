"""Renders the record columns of rows, those that many rows have in common only once."""

from collections.abc import Callable
from typing import Final, NamedTuple

from sphero_probe.catalogue.packet_json import SharedKeys
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import Render, View

_MOST: Final = 1024
"""The most patterns that are remembered."""


class _Pattern(NamedTuple):
    """The cells of rows that have most in common.

    Attributes:
        cells: one per column; those that vary are empty.
        shown: place of a cell, place of its value in the row, and how it is shown.
        rendered: place of a cell that is made of several values, and what makes it.
    """

    cells: list[str]
    shown: list[tuple[int, int, Callable[[object], str]]]
    rendered: list[tuple[int, Render]]


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
        self._patterns: dict[SharedKeys, _Pattern] = {}

    def of(self, row: Row) -> list[str]:
        """Return the cells of a row, as the format writes them."""
        escape = self._escape
        if row.keys is None:
            texts = [column.render(row.data) for column in self._columns]
            return [text if text.isalnum() and text.isascii() else text and escape(text) for text in texts]
        pattern = self._patterns.get(row.keys) or self._pattern(row.keys)
        cells, values = pattern.cells.copy(), row.values
        for at, place, show in pattern.shown:
            cells[at] = escape(show(values[place]))
        if pattern.rendered:
            data = {**row.keys.fixed, **dict(zip(row.keys.varying, values, strict=True))}  # in any order
            for at, render in pattern.rendered:
                cells[at] = escape(render(data))
        return cells

    def _pattern(self, keys: SharedKeys) -> _Pattern:
        """Tell apart columns whose value is the same or absent, whose value varies, and of several keys."""
        if len(self._patterns) >= _MOST:
            self._patterns.clear()
        pattern = self._patterns[keys] = _Pattern([], [], [])
        for at, column in enumerate(self._columns):
            cell = ""
            if column.show is None:
                pattern.rendered.append((at, column.render))
            elif column.key in keys.varying:
                pattern.shown.append((at, keys.varying.index(column.key), column.show))
            else:
                cell = self._escape(column.show(keys.fixed.get(column.key)))
            pattern.cells.append(cell)
        return pattern
