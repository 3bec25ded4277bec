"""The options of ``led``."""

import click

from sphero_probe.cli.options import asking_options, device_options, journal_options, output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import AskOptions, ConnectOptions, JournalOptions, Output
from sphero_probe.cli.what_options import led_options


@click.command("led", cls=StrictCommand)
@led_options
@click.option("--list", "listed", is_flag=True, help="List the robot's LEDs and set none.")
@asking_options
@device_options
@journal_options
@output_options
def command(
    output: Output,
    journal: JournalOptions,
    connecting: ConnectOptions,
    asking: AskOptions,
    front: str | None,
    back: str | None,
    leds: tuple[str, ...],
    off: bool,
    listed: bool,
) -> None:
    """Set LEDs by name and colour; --list prints the names for a robot.

    Example: sphero-probe led --front ff0000 --back 00f --device fake:bolt-plus
    """
    from sphero_probe.cli.actions.led import list_leds, set_leds

    if listed:
        list_leds(output, connecting.device)
        return
    set_leds(output, journal, connecting, asking, front, back, leds, off=off)
