"""``fleet scan``: list the robots nearby through all adapters, and write a fleet file."""

from pathlib import Path

from sphero_probe.cli.fleet_robots import robots_of, scan_all
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import Output
from sphero_probe.fleet.robots_file import check_writable, write_robots
from sphero_probe.reports.rows import robot_row
from sphero_probe.reports.views import ROBOTS
from sphero_probe.transports.base import WHY_UNHEARD, Seen


def fleet_scan(output: Output, seconds: float, save: str | None, adapters: tuple[str, ...]) -> None:
    """Scan with every adapter, list the robots, and write the fleet file.

    Args:
        output: where and how to list them.
        seconds: how long to listen.
        save: the fleet file, None for none.
        adapters: the adapters to use, empty for all.

    Raises:
        UnavailableError: Bluetooth cannot be used here.
        OutputError: the file cannot be written.
    """
    if save is not None:
        check_writable(Path(save))
    seen: list[Seen] = []

    async def work() -> None:
        seen.extend(await scan_all(seconds, adapters))

    run_interruptible(Interrupts(), work())
    show(output, ROBOTS, map(robot_row, seen))
    if not seen:
        say(f"no robot was heard within {seconds:g} s: {WHY_UNHEARD}")
    elif save is not None:
        write_robots(Path(save), robots_of(seen))
        say(f"wrote {save}; to check all robots: sphero-probe fleet health --robots {save}", limit=None)
