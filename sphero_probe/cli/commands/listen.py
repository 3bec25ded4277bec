"""``listen``: a robot's address goes in, what it says unasked comes out as it comes."""

import click

from sphero_probe.cli.options import RISKS, device_options, output_options
from sphero_probe.cli.output import Output


@click.command("listen")
@click.option("--count", type=click.IntRange(min=1), metavar="N", help="Stop after N packets.")
@click.option(
    "--seconds", type=click.FloatRange(min=0.01), metavar="SECONDS", help="Stop after so much time."
)
@click.option(
    "--send",
    "commands",
    multiple=True,
    metavar="COMMAND",
    help="Send this first, like 'power.wake' or '0x18 0x00 0096000000E000'; may be repeated.",
)
@click.option("--allow", multiple=True, type=click.Choice(RISKS), help="Allow a risk class, for --send.")
@click.option("--confirm", default="", metavar="NAME", help="The robot's name, to allow the brick class.")
@device_options
@output_options
def command(
    output: Output,
    count: int | None,
    seconds: float | None,
    commands: tuple[str, ...],
    allow: tuple[str, ...],
    confirm: str,
    device: str,
    **connecting: object,
) -> None:
    """Show notifications as they come, decoded, until Ctrl-C.

    Most have to be switched on first; --send does that.

    Example: sphero-probe listen --send power.wake --seconds 1 --device fake:bolt
    """
    from sphero_probe.cli.actions.listen import listen
    from sphero_probe.link.policy import Consent

    listen(output, device, Consent.of(allow, confirm), commands, count=count, seconds=seconds, **connecting)
