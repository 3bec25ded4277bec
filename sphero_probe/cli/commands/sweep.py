"""``sweep``: ranges or a plan go in, what exists on the robot comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.complete.offers import offer_dids, offer_plans
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
    from sphero_probe.link.policy import Consent
    from sphero_probe.probing.plan import Plan
    from sphero_probe.protocol.packets import Generation
    from sphero_probe.runs.resume import RunJournal


@click.command("sweep")
@click.option(
    "--did", metavar="IDS", help="Device ids: 0x13, 0x10-0x1a,0x1f, power.", shell_complete=offer_dids
)
@click.option("--cid", metavar="IDS", help="Command ids.  [default: 0x00-0xff]")
@click.option(
    "--plan",
    "plan_file",
    metavar="FILE",
    help="A plan file, or the name of a shipped plan.",
    shell_complete=offer_plans,
)
@click.option("--payload", metavar="HEX", help="Send exactly these bytes with every command.")
@asking_options
@device_options
@resume_option
@journal_options
@output_options
def command(
    output: Output,
    journal_choice: JournalOptions,
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
    withheld and shown as skipped. What was found is kept: --resume goes on with a run that was cut off.

    Example: sphero-probe sweep --did 0x13 --device fake:bolt-plus
    """
    from sphero_probe.cli.output import warn
    from sphero_probe.cli.run import run_plan
    from sphero_probe.errors import UsageError
    from sphero_probe.link.policy import Consent
    from sphero_probe.runs.resume import RunJournal
    from sphero_probe.session.addressing import address_of, generation_behind

    generation = generation_behind(address_of(device))
    consent = Consent.of(allow, confirm)
    asked = (did, cid, plan_file, payload)
    if dry_run:
        if journal_choice.resume:
            raise UsageError("--dry-run tells of a new run", "leave --resume out")
        plan, _ = _plan(generation, *asked)
        _show_dry(output, plan, device, consent, target)
        return
    with RunJournal("sweep", **journal_choice._asdict(), on_warning=warn) as run_journal:
        if journal_choice.resume and not any(asked):
            plan, run_journal.options = _plan_of_before(generation, run_journal)
        else:
            plan, run_journal.options = _plan(generation, *asked)
        run_plan(plan, output, device, consent, target, run_journal, **connecting)


def _show_dry(output: Output, plan: "Plan", device: str, consent: "Consent", target: str | None) -> None:
    from sphero_probe.cli.dry_run import print_dry_run_note
    from sphero_probe.cli.parse import node
    from sphero_probe.probing.dry_run import planned_probes
    from sphero_probe.reports.rows import planned_row
    from sphero_probe.reports.views import PLANNED
    from sphero_probe.session.addressing import address_of, generation_behind, model_behind, port_behind

    place = address_of(device)
    robot = model_behind(place)
    print_dry_run_note()
    address = node(target, robot, port_behind(place))
    output.show(
        PLANNED, map(planned_row, planned_probes(plan, generation_behind(place), robot, consent, address))
    )


def _plan(
    generation: "Generation", did: str | None, cid: str | None, plan_file: str | None, payload: str | None
) -> "tuple[Plan, dict[str, str]]":
    """Return the plan, and the options that a journal needs to make it again."""
    from sphero_probe.cli.parse import hex_bytes, id_range
    from sphero_probe.errors import UsageError
    from sphero_probe.probing.plan import Plan, sweep
    from sphero_probe.probing.plans.shipped import find_plan, is_shipped

    if plan_file is not None:
        if did is not None or cid is not None or payload is not None:
            raise UsageError("--plan says what to ask: leave --did, --cid and --payload out")
        plan = find_plan(plan_file)
        if plan.file is None or is_shipped(plan.file):
            return plan, {"plan": plan.file.stem if plan.file else plan.name}
        return plan, {"plan_file": str(plan.file.absolute())}
    if did is None:
        raise UsageError("nothing to sweep", "try: sphero-probe sweep --did 0x13, or --plan hello")
    dids = id_range(did, generation, devices=True)
    cids = id_range(cid or "0x00-0xff", generation, devices=False)
    exact = None if payload is None else hex_bytes(payload, "--payload")
    probes = list(sweep(dids, cids, payload=exact))
    options = {"did": _ids(dids), "cid": _ids(cids)}
    if exact is not None:
        options["payload"] = exact.hex()
    return Plan("sweep", f"DID {did}, CID {cid or '0x00-0xff'}", [probes]), options


def _ids(ids: tuple[int, ...]) -> str:
    """Return ids as ``--did`` takes them, in their order."""
    from sphero_probe.reports.ids import spans

    return ",".join(spans(ids) if list(ids) == sorted(ids) else (f"0x{one:02x}" for one in ids))


def _plan_of_before(generation: "Generation", run_journal: "RunJournal") -> "tuple[Plan, dict[str, str]]":
    """Make the plan of an interrupted run again; only a plan that comes with the tool is run unasked."""
    from sphero_probe.errors import BadInputFileError, UsageError
    from sphero_probe.probing.plans.loader import load_plan
    from sphero_probe.probing.plans.shipped import plan_files

    if run_journal.opening is None:
        raise BadInputFileError(
            f"{run_journal.place}: nothing is written in it yet", "say what to sweep: --did 0x13"
        )
    options = run_journal.opening.options
    if file := options.get("plan_file"):
        raise UsageError(
            "that run asked a plan of your own, which a journal cannot bring along", f"add --plan {file}"
        )
    if name := options.get("plan"):
        for path in plan_files():
            if path.stem == name:
                return load_plan(path), options
        raise BadInputFileError(f"the journal's plan {name} does not come with this version of the tool")
    try:
        return _plan(generation, options.get("did"), options.get("cid"), None, options.get("payload"))
    except UsageError as error:
        raise BadInputFileError(f"the journal does not tell what to ask: {error}") from error
