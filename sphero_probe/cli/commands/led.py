"""The options of ``led``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import asking_options, device_options, journal_options, output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import AskOptions, ConnectOptions, JournalOptions, Output


@click.command("led", cls=StrictCommand)
@click.option("--front", metavar="COLOUR", help="The front LED (on a Mini: the body): ff0000, f00 or red.")
@click.option("--back", metavar="COLOUR", help="The back LED.")
@click.option(
    "--led",
    "leds",
    multiple=True,
    metavar="NAME=COLOUR",
    help="An LED by name; may be repeated.",
    shell_complete=offer("leds"),
)
@click.option("--off", is_flag=True, help="Switch off all LEDs that are not named.")
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
