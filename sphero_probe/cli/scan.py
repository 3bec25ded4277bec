"""``scan``: the air goes in, a list of robots comes out."""

from fnmatch import fnmatchcase

import click

from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output


@click.command("scan")
@click.option(
    "--timeout",
    type=click.FloatRange(min=0.1, max=600),
    default=5.0,
    metavar="SECONDS",
    help="How long to listen.  [default: 5]",
)
@click.option("--all", "everything", is_flag=True, help="Also what is no Sphero.")
@click.option("--name", "pattern", metavar="GLOB", help="Only names like 'BP-*'.")
@click.option("--adapter", default="", metavar="NAME", help="The Bluetooth adapter, like hci1.")
@output_options
def command(output: Output, timeout: float, everything: bool, pattern: str | None, adapter: str) -> None:
    """List the robots nearby: name, model, address, signal strength.

    Example: sphero-probe scan --timeout 3 --json
    """
    from sphero_probe.cli.interrupts import Interrupts, run_interruptible
    from sphero_probe.reports.rows import robot_row
    from sphero_probe.reports.views import ROBOTS
    from sphero_probe.transports.base import OpenOptions, Seen
    from sphero_probe.transports.registry import scan

    seen: list[Seen] = []

    async def work() -> None:
        seen.extend(await scan(OpenOptions(timeout, adapter), everything=everything))

    run_interruptible(Interrupts(), work())
    matching = [robot for robot in seen if pattern is None or fnmatchcase(robot.name, pattern)]
    output.show(ROBOTS, map(robot_row, matching))
    if not matching:
        click.echo(
            f"no robot was heard within {timeout:g} s: is it awake (shake it), in range, "
            "and not connected to a phone?",
            err=True,
        )
