"""A line on standard error, erased at the end: the stage, what was found, elapsed time and time left."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import ceil
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, Task, TextColumn
from rich.progress import Progress as Bar
from rich.table import Column
from rich.text import Text

from sphero_probe.probing.progress import Progress
from sphero_probe.reports.printable import visible

_WIDEST: Final = 30
"""Columns of the bar: after a full line, the echo of Ctrl-C would begin another and leave the first there."""
_NARROW: Final = 70
"""Columns of a terminal below which only the stage, the bar and the time left are shown."""
_NAME: Final = 24
"""Characters of a stage's name."""


class _AsciiConsole(Console):
    """A terminal that shows only ASCII, whatever its stream accepts."""

    @property
    def encoding(self) -> str:
        return "ascii"


class _Elapsed(ProgressColumn):
    """The time so far; it goes on while nothing is reported."""

    def render(self, task: Task) -> Text:
        return Text(clock(int(task.elapsed or 0)), style="progress.elapsed")


def clock(seconds: float) -> str:
    """Return a duration as ``0:07`` or ``1:02:03``, rounded up."""
    minutes, whole_seconds = divmod(ceil(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{whole_seconds:02}" if hours else f"{minutes}:{whole_seconds:02}"


def stage_text(progress: Progress, *, unicode: bool = True) -> str:
    """Return which stage a run is in, ``stage 4/6: devices``; only its name if there are no others."""
    name = visible(progress.stage, limit=_NAME, unicode=unicode)
    return f"stage {progress.number}/{progress.stages}: {name}" if progress.stages > 1 else name


def count_text(progress: Progress) -> str:
    """Return how many probes are done, ``12/345``; a ``+`` says that more follow."""
    return f"{progress.done}/{progress.total}{'' if progress.is_total_known else '+'}"


def found_text(progress: Progress) -> str:
    """Return what was found so far, ``12 exist, 2 new``; empty if nothing was."""
    if not progress.exist:
        return ""
    return f"{progress.exist} exist" + (f", {progress.new} new" if progress.new else "")


def left_text(progress: Progress) -> str:
    """Return the time left, ``0:12 left``; with a ``+`` where more follows, empty while it is not known."""
    if progress.seconds_left is None:
        return ""
    return f"{clock(progress.seconds_left)}{'' if progress.is_total_known else '+'} left"


@contextmanager
def progress_bar(title: str, *, color: bool, unicode: bool) -> Iterator[Callable[[Progress], None]]:
    """Show a line on standard error that tells how far a run is.

    The bar is the share of the time; of the probes, while the time left is not known.

    Args:
        title: what is shown before the first step is reported.
        color: it may be coloured.
        unicode: False keeps it within ASCII.

    Yields:
        A function that takes how far the run is.
    """
    console = (Console if unicode else _AsciiConsole)(
        stderr=True, color_system="auto" if color else None, no_color=not color, highlight=False
    )
    is_narrow = console.width < _NARROW

    def column(field: str) -> TextColumn:
        return TextColumn(f"{{task.{field}}}", markup=False, table_column=Column(no_wrap=True))

    wide = () if is_narrow else (column("fields[count]"), column("fields[found]"), _Elapsed())
    columns = (
        column("description"),
        BarColumn(bar_width=None, table_column=Column(max_width=_WIDEST)),
        *wide,
        column("fields[left]"),
    )
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=None, count="", found="", left="")

        def show(progress: Progress) -> None:
            elapsed, left = bar.tasks[0].elapsed or 0.0, progress.seconds_left
            by_time = progress.is_total_known and left is not None
            bar.update(
                task,
                description=stage_text(progress, unicode=unicode),
                completed=elapsed if by_time else progress.done,
                total=elapsed + (left or 0.0) if by_time else progress.total,
                count=count_text(progress),
                found=found_text(progress),
                left=left_text(progress),
            )

        yield show
