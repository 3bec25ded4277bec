"""The options of ``decode``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.command("decode", cls=StrictCommand)
@click.argument("inputs", nargs=-1, metavar="[HEX | FILE | -]...", shell_complete=offer("files"))
@click.option("--v1", "generation", flag_value="v1", help="Decode everything as V1.")
@click.option("--v2", "generation", flag_value="v2", help="Decode everything as V2.")
@click.option(
    "--robot",
    "model",
    metavar="MODEL",
    help="Decode for this model, like bolt-plus.",
    shell_complete=offer("robots"),
)
@click.option(
    "--explain", is_flag=True, help="Print each packet byte by byte: offset, raw, field, value, meaning."
)
@output_options
def command(
    output: Output, inputs: tuple[str, ...], generation: str | None, model: str | None, explain: bool
) -> None:
    """Decode packets from hex bytes, files (binary or hex text) or standard input (-).

    V1 and V2 packets are recognised, also within one input. Bytes that are not a packet are shown with the
    reason. A V1 response is named after its command, if the input holds it.

    Example: sphero-probe decode 8d0a131007cbd8
    """
    from sphero_probe.cli.actions.decode import decode

    decode(output, inputs, generation, model, explain=explain)
