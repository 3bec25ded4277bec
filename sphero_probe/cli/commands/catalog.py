"""The options of ``catalog``."""

import click

from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.options import output_options
from sphero_probe.cli.strict import StrictCommand
from sphero_probe.cli.values import Output


@click.command("catalog", cls=StrictCommand)
@click.argument("pattern", required=False, metavar="[FILTER]", shell_complete=offer("filters"))
@click.option(
    "--robot",
    "model",
    metavar="MODEL",
    help="Only commands of this model, like bolt.",
    shell_complete=offer("robots"),
)
@click.option("--v1", "generation", flag_value="v1", help="Only first-generation commands.")
@click.option("--v2", "generation", flag_value="v2", help="Only second-generation commands.")
@click.option(
    "--compare",
    "library",
    metavar="LIBRARY",
    help="Compare with another library: spherov2 if it is installed, or a path.",
    shell_complete=offer("libraries"),
)
@output_options
def command(
    output: Output, pattern: str | None, model: str | None, generation: str | None, library: str | None
) -> None:
    """List the known commands; FILTER is part of a name, a risk class, or an id like 0x13.

    With --compare, list what only the catalogue or only the library knows, of the robots that the library
    has. Its source is read and never run.

    Example: sphero-probe catalog battery --robot bolt
    """
    from sphero_probe.cli.actions.catalog import compare, list_commands

    if library is None:
        list_commands(output, pattern, model, generation)
    else:
        compare(output, library, pattern, model, generation)
