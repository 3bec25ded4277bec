"""Writes rows to a file or standard output, as the output options say."""

import errno
import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TextIO

from sphero_probe.cli.values import Output
from sphero_probe.errors import OutputError
from sphero_probe.reports.registry import Report, Style, open_report
from sphero_probe.reports.rows import Row
from sphero_probe.reports.streams import takes_unicode, wants_color
from sphero_probe.reports.views import View

_READ_FIRST = "start the program that reads it first"
_WIDTH = 100
"""Columns of a table where the width of the terminal is not known."""


@contextmanager
def report(output: Output, view: View, *, live: bool = False) -> Iterator[Report]:
    """Open a report; leaving the block closes it and its file.

    Args:
        output: where and how to write.
        view: the columns that the tabular formats show.
        live: flush after every row, if the format writes row by row.

    Raises:
        OutputError: the file cannot be written.
        OSError: standard output cannot be written.
    """
    with _stream(output) as stream:
        opened = open_report(output.format, stream, view=view, style=style_for(output, stream))
        try:
            yield _Flushed(opened, stream) if live else opened
        finally:
            opened.close()
            stream.flush()


def show(output: Output, view: View, rows: Iterable[Row]) -> None:
    """Write all rows at once.

    Args:
        output: where and how to write.
        view: the columns that the tabular formats show.
        rows: what to write.

    Raises:
        OutputError: the file cannot be written.
        OSError: standard output cannot be written.
    """
    with report(output, view) as opened:
        for row in rows:
            opened.add(row)


@contextmanager
def _stream(output: Output) -> Iterator[TextIO]:
    if output.file is None:
        yield sys.stdout
        return
    try:
        with open(output.file, "w", encoding="utf-8", newline="", opener=_open) as stream:
            yield stream
    except OSError as error:
        if error.errno == errno.ENXIO:
            raise OutputError(f"cannot write {output.file}: no program reads it", _READ_FIRST) from error
        raise OutputError(f"cannot write {output.file}: {error.strerror}") from error


def _open(path: str, flags: int) -> int:
    """Open a file to write; a FIFO that no program reads is an error, as waiting for one ignores signals."""
    at_once = getattr(os, "O_NONBLOCK", 0)
    descriptor = os.open(path, flags | at_once, 0o666)
    if at_once:
        os.set_blocking(descriptor, True)
    return descriptor


def style_for(output: Output, stream: TextIO) -> Style:
    """Return what a stream can show, as the output options say."""
    fits = stream.isatty() or "COLUMNS" in os.environ
    width = shutil.get_terminal_size((_WIDTH, 24)).columns if fits else _WIDTH
    color, unicode = wants_color(output.color, stream), takes_unicode(stream)
    return Style(width, color, unicode, output.detail, output.header)


class _Flushed:
    """A report that flushes after every row."""

    def __init__(self, opened: Report, stream: TextIO) -> None:
        self._opened = opened
        self._stream = stream

    def add(self, row: Row) -> None:
        self._opened.add(row)
        self._stream.flush()

    def close(self) -> None:
        self._opened.close()
        self._stream.flush()
