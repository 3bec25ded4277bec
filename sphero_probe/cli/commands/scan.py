"""``scan``: the air goes in, a list of robots comes out, once or as long as it is watched."""

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import click

from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from contextlib import AbstractContextManager

    from sphero_probe.reports.scan_watch import Sightings
    from sphero_probe.transports.base import OpenOptions, Seen

SECONDS: Final = 5.0
"""How long a scan listens unless something else is asked for."""
_FRAME: Final = 0.25
"""Seconds between two looks at what is new."""


@click.command("scan")
@click.option(
    "--timeout",
    type=click.FloatRange(min=0.1, max=600),
    metavar="SECONDS",
    help=f"How long to listen.  [default: {SECONDS:g}; with --watch until Ctrl-C]",
)
@click.option("--all", "everything", is_flag=True, help="Also what is no Sphero.")
@click.option("--name", "pattern", metavar="GLOB", help="Only names like 'BP-*'.")
@click.option("--watch", "watching", is_flag=True, help="Go on: show who comes and goes.")
@click.option("--adapter", default="", metavar="NAME", help="The Bluetooth adapter, like hci1.")
@output_options
def command(
    output: Output,
    timeout: float | None,
    everything: bool,
    pattern: str | None,
    watching: bool,
    adapter: str,
) -> None:
    """List the robots nearby: name, model, address, signal strength.

    A robot that advertises is heard; one that is connected to this machine is listed, too.

    Example: sphero-probe scan --timeout 3 --json
    """
    from sphero_probe.reports.scan_watch import Sightings
    from sphero_probe.transports.base import OpenOptions

    seconds = timeout or (float("inf") if watching else SECONDS)
    options = OpenOptions(seconds, adapter)
    if watching:
        sightings = Sightings()
        try:
            _watch(output, options, sightings, everything=everything, pattern=pattern)
        finally:
            _remember(sighting.seen for sighting in sightings.listed())
    else:
        _scan(output, options, everything=everything, pattern=pattern)


def _scan(output: Output, options: "OpenOptions", *, everything: bool, pattern: str | None) -> None:
    """Listen, and list who was heard."""
    from sphero_probe.cli.signals import Interrupts, run_interruptible
    from sphero_probe.reports.rows import robot_row
    from sphero_probe.reports.views import ROBOTS
    from sphero_probe.transports.registry import scan

    seen: list[Seen] = []

    async def work() -> None:
        seen.extend(await scan(options, everything=everything))

    run_interruptible(Interrupts(), work())
    _remember(seen)
    matching = [robot for robot in seen if _matches(robot, pattern)]
    output.show(ROBOTS, map(robot_row, matching))
    if not matching:
        _say_why(len(seen), pattern, options.timeout)


def _watch(
    output: Output, options: "OpenOptions", sightings: "Sightings", *, everything: bool, pattern: str | None
) -> None:
    """Listen on and on, and show who comes and goes: in a table on a terminal, else a record each."""
    from time import monotonic

    from sphero_probe.cli.signals import Interrupts, run_interruptible

    def hear(robot: "Seen") -> None:
        if _matches(robot, pattern):
            sightings.hear(robot, monotonic())

    async def work() -> None:
        import asyncio

        from sphero_probe.transports.registry import watch

        listening = asyncio.create_task(watch(options, hear, everything=everything))
        try:
            with _shown(output, sightings) as show:
                while not listening.done():
                    show()
                    await asyncio.wait({listening}, timeout=_FRAME)
                show()
            listening.result()
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)

    run_interruptible(Interrupts(), work())
    if not sightings.listed():
        _say_why(0, pattern, options.timeout)


def _shown(output: Output, sightings: "Sightings") -> "AbstractContextManager[Callable[[], None]]":
    """Return what shows the robots, again each time it is called."""
    import os
    import sys

    if output.format != "table" or output.file or not sys.stdout.isatty():
        return _records(output, sightings)
    if os.environ.get("TERM", "").lower() in ("dumb", "unknown"):
        return _records(output._replace(chosen="plain"), sightings)
    return _live(output, sightings)


@contextmanager
def _live(output: Output, sightings: "Sightings") -> "Iterator[Callable[[], None]]":
    import sys
    from time import monotonic

    from sphero_probe.reports.scan_watch import LiveTable
    from sphero_probe.reports.streams import takes_unicode, wants_color

    color, unicode = wants_color(output.color, sys.stdout), takes_unicode(sys.stdout)
    with LiveTable(sys.stdout, color=color, unicode=unicode) as table:
        yield lambda: table.draw(sightings.listed(), monotonic())


@contextmanager
def _records(output: Output, sightings: "Sightings") -> "Iterator[Callable[[], None]]":
    from sphero_probe.reports.rows import robot_row
    from sphero_probe.reports.views import ROBOTS

    with output.report(ROBOTS, live=True) as report:

        def show() -> None:
            for robot in sightings.news():
                report.add(robot_row(robot))

        if output.format != "table":
            yield show
            return
        try:
            yield lambda: None
        finally:  # a table has its rows at the end, each robot once
            for sighting in sightings.listed():
                report.add(robot_row(sighting.seen))


def _matches(robot: "Seen", pattern: str | None) -> bool:
    from fnmatch import fnmatchcase

    return pattern is None or fnmatchcase(robot.name.casefold(), pattern.casefold())


def _remember(seen: "Iterable[Seen]") -> None:
    """Keep the robots for completion."""
    from sphero_probe.cli.complete.last_scan import remember

    strongest = sorted(seen, key=lambda robot: robot.rssi or -128, reverse=True)
    remember(robot for robot in strongest if robot.is_sphero)


def _say_why(others: int, pattern: str | None, seconds: float) -> None:
    """Say on standard error why the list may be empty."""
    from sphero_probe.cli.output import say
    from sphero_probe.transports.base import WHY_UNHEARD

    if others and pattern is not None:
        many = "1 robot was" if others == 1 else f"{others} robots were"
        said = f"{many} heard, and none has a name like '{pattern[:40]}'"
    else:
        said = f"no robot was heard within {seconds:g} s: {WHY_UNHEARD}"
    say(said)
