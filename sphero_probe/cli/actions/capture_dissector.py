"""``capture dissector``: print the Wireshark dissector."""

import click

from sphero_probe import __version__
from sphero_probe.captures.dissector import dissector


def print_dissector() -> None:
    """Print the Lua script."""
    click.echo(dissector(__version__), nl=False)
