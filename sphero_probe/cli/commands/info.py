"""The options of ``info``."""

import click

from sphero_probe.cli.options import device_options, output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import ConnectOptions, Output


@click.command("info", cls=StrictCommand)
@device_options
@output_options
def command(output: Output, connecting: ConnectOptions) -> None:
    """Ask a robot about itself: firmware per node, battery, addresses, SKU.

    Example: sphero-probe info --device fake:bolt-plus
    """
    from sphero_probe.cli.actions.info import show_info

    show_info(output, connecting)
