"""The options of ``scan``."""

from typing import Final

import click

from sphero_probe.cli.options import adapter_option, output_options, seconds_option
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output

SECONDS: Final = 5.0
"""How long a scan listens by default."""


@click.command("scan", cls=StrictCommand)
@seconds_option(
    "--timeout",
    least=0.1,
    most=600,
    about=f"How long to listen.  [default: {SECONDS:g}s; with --watch until Ctrl-C]",
)
@click.option("--all", "everything", is_flag=True, help="Also list devices that are not Spheros.")
@click.option("--name", "pattern", metavar="GLOB", help="Only robots whose name matches, like 'BP-*'.")
@click.option("--watch", "watching", is_flag=True, help="Keep scanning, and show robots as they come and go.")
@adapter_option()
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

    Robots that are connected to this machine are listed too.

    Example: sphero-probe scan --timeout 3 --json
    """
    from sphero_probe.cli.actions.scan import list_robots, watch_robots

    if watching:
        watch_robots(output, timeout or float("inf"), adapter, pattern, everything=everything)
    else:
        list_robots(output, timeout or SECONDS, adapter, pattern, everything=everything)
