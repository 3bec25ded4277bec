"""Lists the formats of a report and opens one.

A format is a module with a function ``report(out, *, view, style)`` and a line in ``FORMATS``. It is
imported when it is chosen.
"""

from importlib import import_module
from typing import Final, NamedTuple, Protocol, TextIO

from sphero_probe.errors import UsageError
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import View

FORMATS: Final[dict[str, str]] = {
    "table": "sphero_probe.reports.formats.table",
    "plain": "sphero_probe.reports.formats.plain",
    "json": "sphero_probe.reports.formats.json_array",
    "jsonl": "sphero_probe.reports.formats.json_lines",
    "csv": "sphero_probe.reports.formats.csv_rows",
    "md": "sphero_probe.reports.formats.markdown",
    "html": "sphero_probe.reports.formats.html",
    "junit": "sphero_probe.reports.formats.junit_xml",
}
"""Name -> the module that writes it."""
PAGES: Final = frozenset(("table", "md", "html", "junit"))
"""The formats that are written when all rows have arrived."""


class Style(NamedTuple):
    """What the output stream can show.

    Attributes:
        width: columns; a table uses at least 60.
        color: colour may be used; nothing is said by colour alone.
        unicode: False keeps everything within ASCII.
        detail: list what a table folds.
        header: begin tab-separated records with the names of the columns.
    """

    width: int = 80
    color: bool = False
    unicode: bool = True
    detail: bool = False
    header: bool = False


class Report(Protocol):
    """Writes rows to the stream it was opened with; the stream stays open."""

    def add(self, row: Row) -> None:
        """Take the next row.

        Raises:
            OSError: the stream cannot be written.
        """
        ...

    def close(self) -> None:
        """Write the rest; no row may be added afterwards.

        Raises:
            OSError: the stream cannot be written.
        """
        ...


class _Opener(Protocol):
    def __call__(self, out: TextIO, *, view: View, style: Style) -> Report: ...


def open_report(format: str, out: TextIO, *, view: View, style: Style) -> Report:  # noqa: A002
    """Open a report.

    Args:
        format: a name of ``FORMATS``.
        out: where it is written; the caller flushes and closes it.
        view: the rows that the tabular formats show; the JSON formats show all.
        style: what ``out`` can show.

    Raises:
        UsageError: no such format.
    """
    if format not in FORMATS:
        raise UsageError(f"no format '{format}'", f"known: {', '.join(FORMATS)}")
    opener: _Opener = import_module(FORMATS[format]).report
    return opener(out, view=view, style=style)
