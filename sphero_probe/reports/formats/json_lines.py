"""The format ``jsonl``: one JSON object per line, each written as soon as it arrives."""

from typing import TextIO

from sphero_probe.reports.json_text import JsonObjects
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View


class JsonLines:
    """Writes every row, of whatever type."""

    def __init__(self, out: TextIO) -> None:
        self._write = out.write
        self._text = JsonObjects().text

    def add(self, row: Row) -> None:
        """Write a line."""
        self._write(self._text(row) + "\n")

    def close(self) -> None:
        """Nothing is left to write."""


def report(out: TextIO, *, view: View, style: Style) -> JsonLines:  # noqa: ARG001 - JSON shows all, as it is
    """Open a report in this format."""
    return JsonLines(out)
