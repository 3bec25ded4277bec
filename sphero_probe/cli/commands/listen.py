"""The options of ``listen``."""

import click

from sphero_probe.cli.options import consent_options, device_options, output_options, seconds_option
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import AskOptions, ConnectOptions, Output


@click.command("listen", cls=StrictCommand)
@click.option("--count", type=click.IntRange(min=1), metavar="N", help="Stop after N packets.")
@seconds_option("--seconds", least=0.01, most=30 * 86400, about="Stop after this time.")
@click.option(
    "--send",
    "commands",
    multiple=True,
    metavar="COMMAND",
    help="Send this command first: 'power.wake', '0x18 0x00 0096000000E000'; may be repeated.",
)
@consent_options
@device_options
@output_options
def command(
    output: Output,
    connecting: ConnectOptions,
    asking: AskOptions,
    count: int | None,
    seconds: float | None,
    commands: tuple[str, ...],
) -> None:
    """Print notifications as they arrive, decoded, until Ctrl-C.

    Most notifications must be enabled first; use --send for that.

    Example: sphero-probe listen --send power.wake --seconds 1 --device fake:bolt
    """
    from sphero_probe.cli.actions.listen import listen

    listen(output, connecting, asking, commands, count=count, seconds=seconds)
