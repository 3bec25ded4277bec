"""``discover``: a robot's address goes in, the full staged map of what it can do comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.completing import offer_dids
from sphero_probe.cli.options import (
    Keeping,
    asking_options,
    device_options,
    journal_options,
    output_options,
    resume_option,
)
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from sphero_probe.probing.plan import Plan


@click.command("discover")
@click.option(
    "--did", metavar="IDS", help="Only these device ids.  [default: all 256]", shell_complete=offer_dids
)
@click.option("--lengths", is_flag=True, help="Also find out which lengths an unknown command takes.")
@click.option("--values", is_flag=True, help="Also try values where one was refused.")
@asking_options
@device_options
@resume_option
@journal_options
@output_options
def command(
    output: Output,
    keeping: Keeping,
    did: str | None,
    lengths: bool,
    values: bool,
    device: str,
    target: str | None,
    allow: tuple[str, ...],
    confirm: str,
    dry_run: bool,
    **connecting: object,
) -> None:
    """Map a whole robot: who it is, its nodes, its devices, every command of each.

    What the robot says of itself is compared with what was found. At the end whatever exists or was silent is
    asked once more, one at a time; what does not say the same again is called inconclusive. --lengths and
    --values execute unknown commands, where --allow covers it.

    Example: sphero-probe discover --device fake:bolt-plus
    """
    from sphero_probe.cli.dry_run import planned_rows, tell_dry_run
    from sphero_probe.cli.keeping import Keeper
    from sphero_probe.cli.running import run_plan
    from sphero_probe.cli.session import address_of, consent_of, generation_behind, model_behind, port_behind
    from sphero_probe.cli.words import node
    from sphero_probe.errors import UsageError
    from sphero_probe.reports.views import PLANNED

    place = address_of(device)
    robot = model_behind(place)
    address = node(target, robot, port_behind(place))
    consent = consent_of(allow, confirm)
    options = {"lengths": str(int(lengths)), "values": str(int(values))} | ({"did": did} if did else {})
    if dry_run:
        if keeping.resume:
            raise UsageError("--dry-run tells of a new run", "leave --resume out")
        tell_dry_run()
        plan = _plan(device, address, options)
        output.show(PLANNED, planned_rows(plan, generation_behind(place), robot, consent, address))
        return
    with Keeper(keeping, "discover") as keeper:
        if keeper.opening and not (did or lengths or values):
            options = dict(keeper.opening.options)
        keeper.options = options
        run_plan(_plan(device, address, options), output, device, consent, target, keeper, **connecting)


def _plan(device: str, address: int | None, options: dict[str, str]) -> "Plan":
    from sphero_probe.cli.session import address_of, generation_behind
    from sphero_probe.cli.words import id_range
    from sphero_probe.probing.discovery import discovery

    generation = generation_behind(address_of(device))
    dids = id_range(options.get("did", "0x00-0xff"), generation, devices=True)
    return discovery(
        generation,
        address,
        dids=dids,
        lengths=options.get("lengths") == "1",
        values=options.get("values") == "1",
    )
