"""The options of ``doctor``."""

from functools import partial

import click

from sphero_probe.cli.options import device_options, output_options, seconds_option
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import ConnectOptions, Output


@click.command("doctor", cls=StrictCommand)
@seconds_option(
    "--timeout",
    least=0.1,
    most=600,
    default=5.0,
    about="For each check of this machine; a robot's answer gets 1s of it at most.  [default: 5s]",
)
@partial(device_options, unnamed="check only this machine")
@output_options
def command(output: Output, connecting: ConnectOptions, timeout: float) -> None:
    """Check that this machine can reach a robot, and suggest fixes.

    Each check prints a line: ok, warn, fail or skipped; exit 1 if one failed. Without --device it connects to
    no robot; with --device it also measures the link to that robot, and where the robot is not reached over
    Bluetooth LE, problems of Bluetooth are only warnings.

    Example: sphero-probe doctor --device BP-1234
    """
    from sphero_probe.cli.actions.doctor import examine

    examine(output, connecting, timeout)
