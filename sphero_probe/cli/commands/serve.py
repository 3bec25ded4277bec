"""The options of ``serve``."""

import click

from sphero_probe.cli.options import seconds_option
from sphero_probe.cli.strict import StrictCommand


@click.command("serve", cls=StrictCommand)
@click.argument("address")
@click.option("--pty", is_flag=True, help="Serve behind a pseudo-terminal.  [default]")
@click.option("--tcp", metavar="HOST:PORT", help="Serve at a TCP port, like 127.0.0.1:0; 0 takes a free one.")
@click.option("--allow-remote", is_flag=True, help="Let --tcp listen where other machines can connect.")
@click.option("--once", is_flag=True, help="Stop when the first client has disconnected.")
@seconds_option("--seconds", least=0.01, most=30 * 86400, about="Stop after this time.")
def command(
    address: str, tcp: str | None, seconds: float | None, *, pty: bool, allow_remote: bool, once: bool
) -> None:
    """Serve a built-in or recorded robot, so that any program can be tested against it.

    ADDRESS is that of a built-in robot, like fake:rvr, or of a recorded one: replay:FILE. The path of the
    pseudo-terminal, or the host and port, is printed on standard output; a program opens that as a serial
    port, or connects to it. One client at a time. The robot stays the same for all of them, until Ctrl-C, or
    until the calling program has ended.

    Example: sphero-probe serve fake:rvr --tcp 127.0.0.1:0 --seconds 1
    """
    from sphero_probe.cli.actions.serve import serve

    serve(address, tcp, seconds, pty=pty, allow_remote=allow_remote, once=once)
