"""``explain``: an error code or a command's ids go in, what is known of them comes out."""

import click

from sphero_probe.cli.complete.offers import offer_commands
from sphero_probe.cli.options import output_options
from sphero_probe.cli.output import Output


@click.command("explain")
@click.argument("subject", metavar="CODE | DID:CID | NAME", shell_complete=offer_commands)
@click.option("--v1", is_flag=True, help="As the first generation means it: Sphero, SPRK+, Ollie, BB-8.")
@output_options
def command(output: Output, subject: str, v1: bool) -> None:
    """Explain an error code (0x05), a command (0x13:0x10) or a name (power.sleep).

    The same byte means something else to the first generation: add --v1 for that.

    Example: sphero-probe explain 0x13:0x10
    """
    from sphero_probe.catalogue import rows_of
    from sphero_probe.cli.parse import byte, pair
    from sphero_probe.errors import UsageError
    from sphero_probe.protocol import CODECS
    from sphero_probe.protocol.packets import Generation
    from sphero_probe.reports.rows import code_row, command_row
    from sphero_probe.reports.views import CODES, COMMAND

    generation = Generation.V1 if v1 else Generation.V2
    if subject[:1].isdigit() and ":" not in subject:
        codec = CODECS[generation]
        code = byte(subject, "error code")
        output.show(CODES, [code_row(generation, code, codec.code_name(code), codec.verdict(code).value)])
        return
    did, cid = pair(subject, generation)
    rows = rows_of(generation, did, cid)
    if not rows:
        raise UsageError(
            f"0x{did:02x}:0x{cid:02x} is in no catalogue",
            f"ask a robot: sphero-probe sweep --did 0x{did:02x} --cid 0x{cid:02x}",
        )
    output.show(COMMAND, map(command_row, rows))
