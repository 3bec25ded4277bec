"""``catalog``: a filter goes in, the known commands that match come out."""

import click

from sphero_probe.cli.complete.offers import offer_filters, offer_robots
from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output


@click.command("catalog")
@click.argument("pattern", required=False, metavar="[FILTER]", shell_complete=offer_filters)
@click.option(
    "--robot",
    "model",
    metavar="MODEL",
    help="Only what this robot has, like bolt.",
    shell_complete=offer_robots,
)
@click.option("--v1", "generation", flag_value="v1", help="Only those of the first generation.")
@click.option("--v2", "generation", flag_value="v2", help="Only those of the second generation.")
@output_options
def command(output: Output, pattern: str | None, model: str | None, generation: str | None) -> None:
    """List the known commands; FILTER is part of a name, a risk class, or an id like 0x13.

    Example: sphero-probe catalog battery --robot bolt
    """
    from sphero_probe.catalogue import ROBOTS, all_rows, async_rows, commands_of, robot_by_word
    from sphero_probe.catalogue.model import CommandRow
    from sphero_probe.cli.parse import choose
    from sphero_probe.protocol.packets import Generation
    from sphero_probe.reports.rows import command_row
    from sphero_probe.reports.views import COMMANDS

    chosen = [Generation(generation)] if generation else list(Generation)
    rows = tuple(row for one in chosen for row in (*all_rows(one), *async_rows(one)))
    if model is not None:
        rows = commands_of(robot_by_word(model) or ROBOTS[choose(model, ROBOTS, "robot")])

    def matches(row: CommandRow) -> bool:
        if pattern is None:
            return True
        words = (row.name, row.risk.word, f"0x{row.did:02x}:0x{row.cid:02x}", *row.aliases)
        return any(pattern.lower() in word for word in words)

    matching = [row for row in rows if matches(row)]
    output.show(COMMANDS, map(command_row, matching))
    if not matching:
        click.echo("no known command matches; see: sphero-probe catalog", err=True)
