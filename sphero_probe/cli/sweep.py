"""``sweep``: ranges or a plan go in, what exists on the robot comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import asking_options, device_options, output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from sphero_probe.probing.plan import Plan
    from sphero_probe.protocol.packets import Generation


@click.command("sweep")
@click.option("--did", metavar="IDS", help="Device ids: 0x13, 0x10-0x1a,0x1f, power.")
@click.option("--cid", metavar="IDS", help="Command ids.  [default: 0x00-0xff]")
@click.option("--plan", "plan_file", metavar="FILE", help="A plan file, or the name of a shipped plan.")
@click.option("--payload", metavar="HEX", help="Send exactly these bytes with every command.")
@asking_options
@device_options
@output_options
def command(
    output: Output,
    did: str | None,
    cid: str | None,
    plan_file: str | None,
    payload: str | None,
    device: str,
    target: str | None,
    allow: tuple[str, ...],
    confirm: str,
    dry_run: bool,
    **connecting: object,
) -> None:
    """Probe ranges of commands, or a plan, and tell what exists.

    Documented reads are asked properly. Everything else is asked at a length that no command takes, which a
    robot refuses without executing; whether this robot does is measured first. What could do harm is
    withheld and shown as skipped.

    Example: sphero-probe sweep --did 0x13 --device fake:bolt-plus
    """
    from sphero_probe.cli.dry_run import planned_rows, tell_dry_run
    from sphero_probe.cli.running import run_plan
    from sphero_probe.cli.session import address_of, consent_of, generation_behind, model_behind, port_behind
    from sphero_probe.cli.words import node
    from sphero_probe.reports.views import PLANNED

    place = address_of(device)
    generation = generation_behind(place)
    plan = _plan(generation, did, cid, plan_file, payload)
    consent = consent_of(allow, confirm)
    if dry_run:
        robot = model_behind(place)
        tell_dry_run()
        rows = planned_rows(plan, generation, robot, consent, node(target, robot, port_behind(place)))
        output.show(PLANNED, rows)
        return
    run_plan(plan, output, device, consent, target, **connecting)


def _plan(
    generation: "Generation", did: str | None, cid: str | None, plan_file: str | None, payload: str | None
) -> "Plan":
    from sphero_probe.cli.words import hex_bytes, id_range
    from sphero_probe.errors import UsageError
    from sphero_probe.probing.plan import Plan, sweep
    from sphero_probe.probing.shelf import find_plan

    if plan_file is not None:
        if did is not None or cid is not None or payload is not None:
            raise UsageError("--plan says what to ask: leave --did, --cid and --payload out")
        return find_plan(plan_file)
    if did is None:
        raise UsageError("nothing to sweep", "try: sphero-probe sweep --did 0x13, or --plan hello")
    dids = id_range(did, generation, devices=True)
    cids = id_range(cid or "0x00-0xff", generation, devices=False)
    exact = None if payload is None else hex_bytes(payload, "--payload")
    probes = list(sweep(dids, cids, payload=exact))
    return Plan("sweep", f"DID {did}, CID {cid or '0x00-0xff'}", [probes])
