"""The options of ``explain``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.command("explain", cls=StrictCommand)
@click.argument(
    "subject", required=False, metavar="CODE | DEVICE | DID:CID | NAME", shell_complete=offer("commands")
)
@click.option("--address", metavar="BYTE", help="Explain an address byte instead, like 0x21 (V2).")
@click.option(
    "--robot",
    "model",
    metavar="MODEL",
    help="With --address: the robot whose nodes have names.",
    shell_complete=offer("robots"),
)
@click.option("--v1", is_flag=True, help="Use the first generation: Sphero, SPRK+, Ollie, BB-8.")
@output_options
def command(output: Output, subject: str | None, address: str | None, model: str | None, v1: bool) -> None:
    """Explain an error code (0x05), a device (power), a command (0x13:0x10, power.sleep) or an address.

    The same byte means something else in the first generation; use --v1 for that.

    Example: sphero-probe explain 0x13:0x10
    """
    from sphero_probe.cli.actions.explain import explain, explain_address

    if address is not None:
        if subject is not None or v1:
            raise click.UsageError("--address explains a V2 address: leave the rest out")
        explain_address(output, address, model)
        return
    if subject is None:
        raise click.UsageError("explain what? write a code, a device, a command, or --address 0x21")
    if model is not None:
        raise click.UsageError("--robot goes with --address")
    explain(output, subject, v1=v1)
