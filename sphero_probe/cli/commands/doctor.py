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
    about="Limit for each check of this machine; an answer of a robot gets 1s at most.  [default: 5s]",
)
@partial(device_options, unnamed="check only this machine", capture=False)
@output_options
def command(output: Output, connecting: ConnectOptions, timeout: float) -> None:
    """Check that this machine can reach a robot, and suggest fixes.

    Each check prints a line: ok, warn, fail or skipped. The exit code is 1 if a check failed. With --device,
    doctor also connects to that robot and measures the link. For a robot that does not use Bluetooth LE,
    Bluetooth problems are only warnings.

    Example: sphero-probe doctor --device BP-1234
    """
    from sphero_probe.cli.actions.doctor import examine

    examine(output, connecting, timeout)
