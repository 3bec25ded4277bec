"""Renders rows as lines of record columns; cells that many rows have in common are rendered only once."""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from sphero_probe.catalogue.packet_json import SharedKeys
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View

_MOST: Final = 1024
"""The most patterns that are remembered."""


class _Pattern(NamedTuple):
    """The lines of rows that have most in common.

    Attributes:
        text: the line, with ``%s`` for every cell that varies.
        shown: place of a value in the row and how it is shown, one per cell that varies; without a place
            the cell is made of several values.
        escaped: which of these cells need it.
        is_complete: the values that vary are all that such cells are made of.
    """

    text: str
    shown: list[tuple[int | None, Callable[[Any], str]]]
    escaped: list[int]
    is_complete: bool


class RecordLines:
    """Renders the record columns of a view's rows, as one line each."""

    def __init__(self, view: View, separator: str, escape: Callable[[str], str]) -> None:
        """Render for one format.

        Args:
            view: the columns.
            separator: what is between two cells.
            escape: the raw text of a cell -> what the format writes.
        """
        self._columns = view.record_columns
        self._separator = separator
        self._escape = escape
        self._patterns: dict[SharedKeys, _Pattern] = {}

    def of(self, row: Row) -> str:
        """Return the line of a row, without its end."""
        if row.keys is None:
            data = row.data
            return self._joined([column.render(data) for column in self._columns])
        text, shown, escaped, is_complete = self._patterns.get(row.keys) or self._pattern(row.keys)
        values = row.values
        data = dict(zip(row.keys.varying, values, strict=True))
        if not is_complete:
            data = {**row.keys.fixed, **data}
        cells = [show(data) if at is None else show(values[at]) for at, show in shown]
        for at in escaped:
            cells[at] = self._escape(cells[at])
        return text % tuple(cells)

    def header(self) -> str:
        """Return the line that names the columns."""
        return self._joined([column.key for column in self._columns])

    def _joined(self, texts: list[str]) -> str:
        escape = self._escape
        return self._separator.join(
            [text if text.isalnum() and text.isascii() else text and escape(text) for text in texts]
        )

    def _pattern(self, keys: SharedKeys) -> _Pattern:
        """Tell apart columns whose value is the same or absent, whose value varies, and of several keys."""
        if len(self._patterns) >= _MOST:
            self._patterns.clear()
        cells: list[str] = []
        shown: list[tuple[int | None, Callable[[Any], str]]] = []
        escaped: list[int] = []
        is_complete = True
        for column in self._columns:
            if column.show is not None and column.key not in keys.varying:
                cell = self._escape(column.show(keys.fixed.get(column.key)))
                cells.append(cell.replace("%", "%%"))
                continue
            cells.append("%s")
            if column.key not in keys.simple or column.show is None:
                escaped.append(len(shown))
            if column.show is None:
                shown.append((None, column.render))
                reads = keys.fixed if column.reads is None else column.reads
                is_complete = is_complete and keys.fixed.keys().isdisjoint(reads)
            else:
                shown.append((keys.varying.index(column.key), column.show))
        pattern = _Pattern(self._separator.join(cells), shown, escaped, is_complete)
        self._patterns[keys] = pattern
        return pattern
