"""A progress bar on standard error, erased at the end: probes done, rate, time left."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, Task, TextColumn, TimeRemainingColumn
from rich.table import Column
from rich.text import Text

_WIDEST: Final = 30
"""Columns of the bar: after a full line, the echo of Ctrl-C would begin another and leave the first there."""


class _AsciiConsole(Console):
    """A terminal that shows only ASCII, whatever its stream accepts."""

    @property
    def encoding(self) -> str:
        return "ascii"


class _TimeLeft(TimeRemainingColumn):
    def render(self, task: Task) -> Text:
        left = super().render(task)
        return left.append(" left") if task.time_remaining else left


@contextmanager
def progress_bar(title: str, *, color: bool, unicode: bool) -> Iterator[Callable[[int, int], None]]:
    """Show a bar on standard error; before the first probe is done, it says "calibrating".

    Args:
        title: the text before the bar.
        color: it may be coloured.
        unicode: False keeps it within ASCII.

    Yields:
        A function that takes the number of probes done and the total.
    """
    console = (Console if unicode else _AsciiConsole)(
        stderr=True, color_system="auto" if color else None, no_color=not color, highlight=False
    )
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=None, table_column=Column(max_width=_WIDEST)),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}", markup=False),
        _TimeLeft(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=None, rate="calibrating")

        def advance(done: int, total: int) -> None:
            speed = bar.tasks[0].speed
            bar.update(task, completed=done, total=total, rate=f"{speed:.0f}/s" if speed else "")

        yield advance
