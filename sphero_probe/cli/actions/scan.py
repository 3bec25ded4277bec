"""``scan``: list the robots nearby, once or until Ctrl-C."""

import asyncio
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from fnmatch import fnmatchcase
from time import monotonic
from typing import Final

from sphero_probe.cli.complete.last_scan import remember
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report, show
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import Output
from sphero_probe.reports.rows import robot_row
from sphero_probe.reports.scan_watch import LiveTable, Sightings
from sphero_probe.reports.streams import takes_unicode, wants_color
from sphero_probe.reports.views import ROBOTS
from sphero_probe.transports.base import WHY_UNHEARD, OpenOptions, Seen
from sphero_probe.transports.registry import scan, watch

_FRAME: Final = 0.25
"""Seconds between two updates."""


def list_robots(
    output: Output, seconds: float, adapter: str, pattern: str | None, *, everything: bool
) -> None:
    """Scan, and list the robots.

    Args:
        output: where and how.
        seconds: how long to listen.
        adapter: the Bluetooth adapter, empty for the usual one.
        pattern: only names that match this glob.
        everything: also list devices that are not Spheros.

    Raises:
        UnavailableError: Bluetooth cannot be used here.
    """
    seen: list[Seen] = []

    async def work() -> None:
        seen.extend(await scan(OpenOptions(seconds, adapter), everything=everything))

    run_interruptible(Interrupts(), work())
    _remember(seen)
    matching = [robot for robot in seen if _matches(robot, pattern)]
    show(output, ROBOTS, map(robot_row, matching))
    if not matching:
        _say_why(len(seen), pattern, seconds)


def watch_robots(
    output: Output, seconds: float, adapter: str, pattern: str | None, *, everything: bool
) -> None:
    """Keep scanning, and show robots as they come and go: a table on a terminal, otherwise records.

    Args:
        output: where and how.
        seconds: how long to listen; infinite for until Ctrl-C.
        adapter: the Bluetooth adapter, empty for the usual one.
        pattern: only names that match this glob.
        everything: also list devices that are not Spheros.

    Raises:
        UnavailableError: Bluetooth cannot be used here.
    """
    sightings = Sightings()

    def hear(robot: Seen) -> None:
        if _matches(robot, pattern):
            sightings.hear(robot, monotonic())

    async def work() -> None:
        listening = asyncio.create_task(watch(OpenOptions(seconds, adapter), hear, everything=everything))
        try:
            with _shown(output, sightings) as draw:
                while not listening.done():
                    draw()
                    await asyncio.wait({listening}, timeout=_FRAME)
                draw()
            listening.result()
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)

    try:
        run_interruptible(Interrupts(), work())
        if not sightings.listed():
            _say_why(0, pattern, seconds)
    finally:
        _remember(sighting.seen for sighting in sightings.listed())


def _shown(output: Output, sightings: Sightings) -> AbstractContextManager[Callable[[], None]]:
    """Return a function that shows the robots as they are now."""
    if output.format != "table" or output.file or not sys.stdout.isatty():
        return _records(output, sightings)
    if os.environ.get("TERM", "").lower() in ("dumb", "unknown"):
        return _records(output._replace(chosen="plain"), sightings)
    return _live(output, sightings)


@contextmanager
def _live(output: Output, sightings: Sightings) -> Iterator[Callable[[], None]]:
    color, unicode = wants_color(output.color, sys.stdout), takes_unicode(sys.stdout)
    with LiveTable(sys.stdout, color=color, unicode=unicode) as table:
        yield lambda: table.draw(sightings.listed(), monotonic())


@contextmanager
def _records(output: Output, sightings: Sightings) -> Iterator[Callable[[], None]]:
    with report(output, ROBOTS, live=True) as rows:

        def add_new() -> None:
            for robot in sightings.news():
                rows.add(robot_row(robot))

        if output.format != "table":
            yield add_new
            return
        try:
            yield lambda: None
        finally:  # a table has its rows at the end, each robot once
            for sighting in sightings.listed():
                rows.add(robot_row(sighting.seen))


def _matches(robot: Seen, pattern: str | None) -> bool:
    return pattern is None or fnmatchcase(robot.name.casefold(), pattern.casefold())


def _remember(seen: Iterable[Seen]) -> None:
    """Keep the robots for completion."""
    strongest = sorted(seen, key=lambda robot: robot.rssi or -128, reverse=True)
    remember(robot for robot in strongest if robot.is_sphero)


def _say_why(others: int, pattern: str | None, seconds: float) -> None:
    """Say on standard error why the list may be empty."""
    if others and pattern is not None:
        many = "1 robot was" if others == 1 else f"{others} robots were"
        said = f"{many} found, but no name matches '{pattern[:40]}'"
    else:
        said = f"no robot was heard within {seconds:g} s: {WHY_UNHEARD}"
    say(said)
