"""Shows on standard error how far each robot of a fleet is; without a terminal, a line when one has ended."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from time import monotonic
from typing import Final, Protocol, Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

from sphero_probe.cli.messages import say
from sphero_probe.fleet.records import Status
from sphero_probe.fleet.results import RobotResult
from sphero_probe.reports.fleet import robot_result_row
from sphero_probe.reports.phrases import found, shown
from sphero_probe.reports.printable import visible
from sphero_probe.reports.streams import takes_unicode, wants_color

_FRAME: Final = 0.1
"""Seconds between two pictures."""
_NAME: Final = 24
_BAR: Final = 20


class Progress(Protocol):
    """Is told of every change."""

    def __call__(self, result: RobotResult) -> None:
        """Show that something happened on a robot."""


def summary(result: RobotResult) -> str:
    """Return how the work on a robot ended, in one line without its name."""
    data = robot_result_row(result).data
    status, trouble, counts = shown(data["status"]), shown(data["trouble"]), found(data)
    if status == Status.DONE:  # it may have had trouble on the way
        counts, trouble = "", "; ".join(filter(None, (counts, trouble)))
    return ": ".join(filter(None, (status, trouble or counts)))


@contextmanager
def fleet_progress(results: Mapping[str, RobotResult], color: str) -> Iterator[Progress]:
    """Show progress while the block lasts.

    Args:
        results: robot name -> its result so far.
        color: ``auto``, ``always`` or ``never``.
    """
    if not sys.stderr.isatty():
        yield _say_end
        return
    with _Lines(results, color) as lines:
        yield lines.draw


def _say_end(result: RobotResult) -> None:
    if result.ended:
        say(f"{result.name}: {summary(result)}")


class _Lines:
    """A line per robot, redrawn in place and erased at the end."""

    def __init__(self, results: Mapping[str, RobotResult], color: str) -> None:
        self._results = results
        self._unicode = takes_unicode(sys.stderr)
        colored = wants_color(color, sys.stderr)
        console = Console(
            stderr=True, color_system="auto" if colored else None, no_color=not colored, highlight=False
        )
        self._console = console
        self._live = Live(
            console=console,
            auto_refresh=False,
            transient=True,
            redirect_stdout=False,
            vertical_overflow="crop",
        )
        self._drawn = 0.0

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def draw(self, result: RobotResult) -> None:
        """Draw all lines, unless they were drawn just now."""
        now = monotonic()
        if now - self._drawn < _FRAME and not result.ended:
            return
        self._drawn = now
        width, height = self._console.size
        shown_first = sorted(self._results.values(), key=lambda one: one.ended is not None)
        lines = [self._line(one, width) for one in shown_first[: max(1, height - 2)]]
        hidden = len(shown_first) - len(lines)
        if hidden:
            lines[-1] = f"and {hidden + 1} more"
        self._live.update(Text("\n".join(lines), no_wrap=True, overflow="crop"), refresh=True)

    def _line(self, result: RobotResult, width: int) -> str:
        name = visible(result.name, limit=_NAME, unicode=self._unicode).ljust(_NAME)
        if result.ended:
            said = summary(result)
        elif result.total:
            full = _BAR * result.done // result.total
            bar = ("━" if self._unicode else "#") * full
            said = f"{bar.ljust(_BAR)} {result.done}/{result.total}"
        else:
            said = result.step
        return f"{name}  {visible(said, limit=max(8, width - _NAME - 3), unicode=self._unicode)}"
