"""The options of ``send``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import (
    asking_options,
    device_options,
    flag_options,
    journal_options,
    output_options,
)
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import AskOptions, ConnectOptions, FlagOptions, JournalOptions, Output


@click.command("send", cls=StrictCommand)
@click.argument(
    "what", nargs=-1, required=True, metavar="DID CID [HEX] | NAME [HEX]", shell_complete=offer("commands")
)
@asking_options
@flag_options
@device_options
@journal_options
@output_options
def command(
    output: Output,
    journal: JournalOptions,
    connecting: ConnectOptions,
    flags: FlagOptions,
    asking: AskOptions,
    what: tuple[str, ...],
) -> None:
    """Send one command and show the answer.

    HEX is the argument bytes: 0102, 01 02 or 0x1 0x2. A command that changes something must be allowed by its
    risk class: --allow write, motion, persist or brick.

    A command that asks for no answer is sent once, and its outcome is "sent". To leave out addresses:
    --target none, --source none.

    Example: sphero-probe send power.get_battery_percentage --device fake:bolt-plus
    """
    from sphero_probe.cli.actions.send import send

    send(output, journal, connecting, asking, flags, what)
