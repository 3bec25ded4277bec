"""The options of ``nodes``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import device_options, output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import ConnectOptions, Output


@click.command("nodes", cls=StrictCommand)
@click.option(
    "--trace",
    metavar="DID:CID",
    help="Print the documented hops of a command and its answer, like 16:41 (hex); send nothing.",
    shell_complete=offer("commands"),
)
@device_options
@output_options
def command(output: Output, connecting: ConnectOptions, trace: str | None) -> None:
    """Find the nodes of a robot: who answers at which address, and what each node serves.

    Nodes 1 to 15 are asked an echo on the client's port and on port 0; so are the wildcard and no address.
    Then each node is asked for its firmware and its devices, and the wildcard for one documented read of each
    device: the answer names the node that served it. Nothing else is sent.

    Example: sphero-probe nodes --device fake:rvr
    """
    from sphero_probe.cli.actions.nodes import show_nodes, trace_hops

    if trace is not None:
        trace_hops(output, connecting, trace)
    else:
        show_nodes(output, connecting)
