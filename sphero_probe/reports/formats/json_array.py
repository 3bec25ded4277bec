"""The format ``json``: one JSON array that holds the objects of ``jsonl``, one per line."""

from typing import TextIO

from sphero_probe.reports.json_text import JsonObjects
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View


class JsonArray:
    """Writes every row, of whatever type; ``[]`` when there is none."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._objects = JsonObjects()
        self._first = True

    def add(self, row: Row) -> None:
        """Write an element."""
        self._out.write(("[\n" if self._first else ",\n") + self._objects.text(row))
        self._first = False

    def close(self) -> None:
        """End the array."""
        self._out.write("[]\n" if self._first else "\n]\n")


def report(out: TextIO, *, view: View, style: Style) -> JsonArray:  # noqa: ARG001 - JSON shows all, as it is
    """Open a report in this format."""
    return JsonArray(out)
