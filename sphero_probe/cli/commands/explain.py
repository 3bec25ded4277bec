"""The options of ``explain``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.command("explain", cls=StrictCommand)
@click.argument("subject", metavar="CODE | DID:CID | NAME", shell_complete=offer("commands"))
@click.option("--v1", is_flag=True, help="Use the first generation: Sphero, SPRK+, Ollie, BB-8.")
@output_options
def command(output: Output, subject: str, v1: bool) -> None:
    """Explain an error code (0x05), a command (0x13:0x10) or a name (power.sleep).

    The same byte means something else in the first generation; use --v1 for that.

    Example: sphero-probe explain 0x13:0x10
    """
    from sphero_probe.cli.actions.explain import explain

    explain(output, subject, v1=v1)
