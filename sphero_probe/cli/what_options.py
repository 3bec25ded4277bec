"""The options that say what to ask or to light, which a command shares with its ``fleet`` twin.

``--help`` imports this module, so it imports nothing but click.
"""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.gathered import Function


def range_options(function: Function) -> Function:
    """Give a command ``--did``, ``--cid``, ``--plan``, ``--payload`` and ``--plan-from`` (``capture``)."""
    return _given(
        function,
        click.option(
            "--did",
            metavar="IDS",
            help="Device ids: 0x13, 0x10-0x1a,0x1f, power.",
            shell_complete=offer("dids"),
        ),
        click.option("--cid", metavar="IDS", help="Command ids.  [default: 0x00-0xff]"),
        click.option(
            "--plan",
            metavar="FILE",
            help="A plan file, the name of a shipped plan, or spherov2-claims.",
            shell_complete=offer("plans"),
        ),
        click.option("--payload", metavar="HEX", help="Send exactly these bytes with every command."),
        click.option(
            "--plan-from",
            "capture",
            metavar="FILE",
            help="Ask the commands that a capture of the maker's app holds.",
            shell_complete=offer("files"),
        ),
    )


def led_options(function: Function) -> Function:
    """Give a command ``--front``, ``--back``, ``--led`` (``leds``) and ``--off``, as parameters so called."""
    return _given(
        function,
        click.option(
            "--front", metavar="COLOUR", help="The front LED (on a Mini: the body): ff0000, f00 or red."
        ),
        click.option("--back", metavar="COLOUR", help="The back LED."),
        click.option(
            "--led",
            "leds",
            multiple=True,
            metavar="NAME=COLOUR",
            help="An LED by name; may be repeated.",
            shell_complete=offer("leds"),
        ),
        click.option("--off", is_flag=True, help="Switch off all LEDs that are not named."),
    )


def _given(function: Function, *options: Function) -> Function:
    """Return the command with options, in the order in which help lists them."""
    for option in reversed(options):
        function = option(function)
    return function
