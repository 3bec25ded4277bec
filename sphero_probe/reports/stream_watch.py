"""The live table of ``stream``: the value of each sensor, its range, and a sparkline."""

from collections import deque
from collections.abc import Sequence
from math import isfinite
from typing import Final, Self, TextIO

from rich.live import Live
from rich.text import Text

from sphero_probe.catalogue.stream_plan import StreamColumn
from sphero_probe.reports.rows import Row
from sphero_probe.reports.samples import SAMPLE
from sphero_probe.reports.sparkline import sparkline
from sphero_probe.reports.terminal import live_console

_KEPT: Final = 500
"""Values of a sensor that are kept for its sparkline and its range."""
_REFRESH: Final = 8
"""Pictures per second at most."""
_HINT: Final = "; Ctrl-C ends"
_NUMBER: Final = 10
"""Columns of a number."""


class StreamWatch:
    """A report of samples that redraws one table in place; the last one stays on the screen."""

    def __init__(self, out: TextIO, columns: Sequence[StreamColumn], *, color: bool, unicode: bool) -> None:
        self._columns = columns
        self._history: dict[str, deque[float]] = {column.name: deque(maxlen=_KEPT) for column in columns}
        self._seconds = 0.0
        self._count = 0
        self._hint = _HINT
        self._unicode = unicode
        self._console = live_console(out, color=color)
        self._live = Live(
            console=self._console,
            get_renderable=self._page,
            refresh_per_second=_REFRESH,
            redirect_stdout=False,
            redirect_stderr=False,
            vertical_overflow="crop",
        )

    def __enter__(self) -> Self:
        """Hide the cursor, and begin to draw."""
        self._live.start(refresh=True)
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the last table on the screen, and show the cursor."""
        self._hint = ""
        self._live.stop()

    def add(self, row: Row) -> None:
        """Take a sample; rows of other types are left out."""
        values, seconds = row.data.get("values"), row.data.get("seconds")
        if row.type != SAMPLE or not isinstance(values, dict):
            return
        self._count += 1
        self._seconds = seconds if isinstance(seconds, int | float) else self._seconds
        for name, value in values.items():
            if isinstance(value, int | float) and isfinite(value) and name in self._history:
                self._history[name].append(value)

    def close(self) -> None:
        """Nothing is left to write."""

    def _page(self) -> Text:
        width, height = self._console.size
        progress = f"{self._count} samples{_rate(self._count, self._seconds)}{self._hint}"
        return page(self._columns, self._history, progress, width, height, unicode=self._unicode)


def _rate(count: int, seconds: float) -> str:
    return f", {count / seconds:.1f} per second" if seconds > 0 else ""


def page(
    columns: Sequence[StreamColumn],
    history: dict[str, deque[float]],
    progress: str,
    width: int,
    height: int,
    *,
    unicode: bool = True,
) -> Text:
    """Return the table: a line for each sensor, never larger than the terminal.

    Args:
        columns: the sensors.
        history: name -> its last values, the newest last.
        progress: the last line.
        width: columns of the terminal.
        height: its lines.
        unicode: False keeps everything within ASCII.
    """
    labels = [f"{column.name} [{column.unit}]" if column.unit else column.name for column in columns]
    wide = max(map(len, labels), default=0)
    room = width - wide - 3 * (_NUMBER + 1) - 3
    titles = f"{'Sensor':<{wide}} {'Value':>{_NUMBER}} {'Least':>{_NUMBER}} {'Most':>{_NUMBER}}"
    lines = [Text(titles[:width], "bold")]
    shown = columns[: max(1, height - 4)]
    for column, label in zip(shown, labels, strict=False):
        values = list(history[column.name])
        numbers = (
            [f"{value:>{_NUMBER}.6g}" for value in (values[-1], min(values), max(values))] if values else []
        )
        text = " ".join((f"{label:<{wide}}", *numbers))
        graph = sparkline(values, room, unicode=unicode) if room >= _NUMBER else ""
        lines.append(Text(f"{text}  {graph}".rstrip()[:width]))
    left = len(columns) - len(shown)
    more = f"{left} sensors not shown; " if left else ""
    lines.append(Text(f"{more}{progress}"[:width], "dim"))
    return Text("\n", no_wrap=True, overflow="crop").join(lines)
