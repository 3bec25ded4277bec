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


class SendCommand(StrictCommand):
    """A command whose ``--help`` explains the command of the robot that is named before it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the command line; print what a robot's command takes if help for it is asked for."""
        names = [word for word in args if not word.startswith("-")]
        if len(names) < len(args) and names and {"-h", "--help"} & set(args):
            from sphero_probe.cli.actions.send_help import show_command_help

            if show_command_help(names):
                ctx.exit()
        return super().parse_args(ctx, args)


@click.command("send", cls=SendCommand)
@click.argument(
    "what",
    nargs=-1,
    required=True,
    metavar="DID CID [ARGUMENTS] | NAME [ARGUMENTS]",
    shell_complete=offer("commands"),
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

    ARGUMENTS are bytes in hex (0102, 01 02, 0x1 0x2) or values by name: speed=64 heading=90deg flags=turbo.
    "send NAME --help" prints what a command takes. A command that changes something must be allowed by its
    risk class: --allow write, motion, persist or brick.

    A command that asks for no answer is sent once, and its outcome is "sent". To leave out addresses:
    --target none, --source none.

    Example: sphero-probe send power.get_battery_percentage --device fake:bolt-plus
    """
    from sphero_probe.cli.actions.send import send

    send(output, journal, connecting, asking, flags, what)
