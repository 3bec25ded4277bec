"""Rows in, the chosen format out: streams, colour and width are decided here."""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Final, NamedTuple, TextIO

from sphero_probe.errors import OutputError

if TYPE_CHECKING:
    from sphero_probe.reports.registry import Report, Style
    from sphero_probe.reports.rows import Row
    from sphero_probe.reports.views import View

FORMATS: Final = ("table", "plain", "json", "jsonl", "csv")
"""The names of the formats; the registry of reports has the same, repeated so that help stays light."""
COLOURS: Final = ("auto", "always", "never")
_BY_SUFFIX: Final = {".json": "json", ".jsonl": "jsonl", ".csv": "csv", ".txt": "table"}


class Output(NamedTuple):
    """Where and how results are shown.

    Attributes:
        chosen: the format that was asked for, None for the default of the place.
        file: a path, None for standard output.
        color: ``auto``, ``always`` or ``never``.
    """

    chosen: str | None
    file: str | None
    color: str

    @property
    def format(self) -> str:
        """The format to write."""
        if self.chosen:
            return self.chosen
        if self.file:
            return _BY_SUFFIX.get(os.path.splitext(self.file)[1].lower(), "plain")  # noqa: PTH122 - as below
        return "table" if sys.stdout.isatty() else "plain"

    @contextmanager
    def report(self, view: "View", *, live: bool = False) -> "Iterator[Report]":
        """Open a report; it is closed, and the file with it, on leaving.

        Args:
            view: the rows that the tabular formats show.
            live: every row reaches the reader as it is added, as far as the format writes row by row.

        Raises:
            OutputError: the file cannot be written.
            OSError: standard output cannot be written.
        """
        from sphero_probe.reports.registry import open_report

        with self._stream() as stream:
            report = open_report(self.format, stream, view=view, style=self._style(stream))
            try:
                yield _Flushed(report, stream) if live else report
            finally:
                report.close()
                stream.flush()

    def show(self, view: "View", rows: "Iterable[Row]") -> None:
        """Write all rows at once.

        Raises:
            OutputError: the file cannot be written.
            OSError: standard output cannot be written.
        """
        with self.report(view) as report:
            for row in rows:
                report.add(row)

    @contextmanager
    def _stream(self) -> Iterator[TextIO]:
        if self.file is None:
            yield sys.stdout
            return
        try:
            with open(self.file, "w", encoding="utf-8", newline="") as stream:  # noqa: PTH123 - pathlib would slow down --help
                yield stream
        except OSError as error:
            raise OutputError(f"cannot write {self.file}: {error.strerror}") from error

    def _style(self, stream: TextIO) -> "Style":
        import shutil

        from sphero_probe.reports.registry import Style

        width = (
            shutil.get_terminal_size((100, 24)).columns if stream.isatty() or "COLUMNS" in os.environ else 100
        )
        from sphero_probe.reports.streams import takes_unicode, wants_color

        return Style(width, wants_color(self.color, stream), takes_unicode(stream))


def say(text: str, *, limit: int | None = 400) -> None:
    """Write a line for a person to standard error, made harmless, above a progress bar if there is one.

    ``click.echo`` would write into the bar. A standard error that is gone is borne.

    Args:
        text: may hold a stranger's text.
        limit: characters of it, None for all.
    """
    from sphero_probe.reports.printable import visible
    from sphero_probe.reports.streams import takes_unicode

    if sys.stderr is not None:
        with suppress(OSError):
            sys.stderr.write(visible(text, limit=limit, unicode=takes_unicode(sys.stderr)) + "\n")
            sys.stderr.flush()


def warn(text: str) -> None:
    """Print a warning on standard error."""
    say(f"warning: {text}")


class _Flushed:
    """A report that holds no row back."""

    def __init__(self, report: "Report", stream: TextIO) -> None:
        self._report = report
        self._stream = stream

    def add(self, row: "Row") -> None:
        self._report.add(row)
        self._stream.flush()

    def close(self) -> None:
        self._report.close()
        self._stream.flush()
