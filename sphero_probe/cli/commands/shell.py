"""The options of ``shell``."""

import click

from sphero_probe.cli.options import device_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import ConnectOptions


@click.command("shell", cls=StrictCommand)
@click.option("--keep-going", is_flag=True, help="Go on after a line of a script that fails.")
@device_options
@click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks.")
def command(connecting: ConnectOptions, keep_going: bool) -> None:
    """Keep one connection, and run commands over it: send, led, sweep, stream and all others.

    Write a command without "sphero-probe" and without --device. Each command needs the same consent as
    outside: --allow and --confirm count for one line. Notifications are printed between the commands. "exit"
    or Ctrl-D ends the shell. Commands can also come from a file or a pipe; lines that begin with # are left
    out.

    Example: sphero-probe shell --device fake:bolt
    """
    from sphero_probe.cli.actions.shell import shell

    shell(connecting, keep_going=keep_going)
