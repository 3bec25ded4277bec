"""``discover``: a robot's address goes in, the full staged map of what it can do comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.complete.offers import offer_dids
from sphero_probe.cli.options import (
    JournalOptions,
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
    journal_choice: JournalOptions,
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
    from sphero_probe.cli.dry_run import print_dry_run_note
    from sphero_probe.cli.output import warn
    from sphero_probe.cli.parse import node
    from sphero_probe.cli.run import run_plan
    from sphero_probe.errors import UsageError
    from sphero_probe.link.policy import Consent
    from sphero_probe.probing.dry_run import planned_probes
    from sphero_probe.reports.rows import planned_row
    from sphero_probe.reports.views import PLANNED
    from sphero_probe.runs.resume import RunJournal
    from sphero_probe.session.addressing import address_of, generation_behind, model_behind, port_behind

    place = address_of(device)
    robot = model_behind(place)
    address = node(target, robot, port_behind(place))
    consent = Consent.of(allow, confirm)
    options = {"lengths": str(int(lengths)), "values": str(int(values))} | ({"did": did} if did else {})
    if dry_run:
        if journal_choice.resume:
            raise UsageError("--dry-run tells of a new run", "leave --resume out")
        print_dry_run_note()
        plan = _plan(device, address, options)
        output.show(
            PLANNED, map(planned_row, planned_probes(plan, generation_behind(place), robot, consent, address))
        )
        return
    with RunJournal("discover", **journal_choice._asdict(), on_warning=warn) as run_journal:
        if run_journal.opening and not (did or lengths or values):
            options = dict(run_journal.opening.options)
        run_journal.options = options
        run_plan(_plan(device, address, options), output, device, consent, target, run_journal, **connecting)


def _plan(device: str, address: int | None, options: dict[str, str]) -> "Plan":
    from sphero_probe.cli.parse import id_range
    from sphero_probe.probing.plans.discovery import discovery
    from sphero_probe.session.addressing import address_of, generation_behind

    generation = generation_behind(address_of(device))
    dids = id_range(options.get("did", "0x00-0xff"), generation, devices=True)
    return discovery(
        generation,
        address,
        dids=dids,
        lengths=options.get("lengths") == "1",
        values=options.get("values") == "1",
    )
