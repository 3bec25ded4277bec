"""``sweep``: probe ranges of commands, or a plan, and report which of them exist."""

from pathlib import Path
from typing import NamedTuple

from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.naming import id_range
from sphero_probe.cli.baseline import Baseline
from sphero_probe.cli.captured_plan import plan_of_capture
from sphero_probe.cli.dry_run import show_dry_run
from sphero_probe.cli.journal import run_journal
from sphero_probe.cli.parse import hex_bytes
from sphero_probe.cli.run import run_plan
from sphero_probe.cli.values import AskOptions, CheckOptions, ConnectOptions, JournalOptions, Output
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.packed_probes import PackedProbes
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plan import sweep as probes_of
from sphero_probe.probing.plans.claims import claims_plan, library_in
from sphero_probe.probing.plans.loader import load_plan
from sphero_probe.probing.plans.shipped import find_plan, is_shipped, plan_files
from sphero_probe.protocol.packets import Generation
from sphero_probe.reports.ids import spans
from sphero_probe.runs.resume import RunJournal
from sphero_probe.session.addressing import address_of, generation_behind, model_behind, port_behind
from sphero_probe.session.commands import node
from sphero_probe.transports.registry import DeviceAddress


class SweepOptions(NamedTuple):
    """What to ask, as typed.

    Attributes:
        did: the devices.
        cid: the commands, None for all.
        plan: a plan's file or name, instead of the other three.
        payload: the bytes to send with each command, None to let the engine choose.
        capture: a capture whose commands are the plan, instead of all the others.
    """

    did: str | None
    cid: str | None
    plan: str | None
    payload: str | None
    capture: str | None = None


def sweep(
    output: Output,
    checks: CheckOptions,
    journal: JournalOptions,
    connecting: ConnectOptions,
    asking: AskOptions,
    options: SweepOptions,
) -> None:
    """Probe ranges or a plan and report the findings, or show what would be sent.

    Args:
        output: where and how to report.
        checks: what the run must come up to.
        journal: which journal to keep.
        connecting: which robot.
        asking: what is allowed, and of which node.
        options: what to ask.

    Raises:
        SpheroProbeError: the options are not valid, or the run ended early.
    """
    place = address_of(connecting.device)
    if asking.dry_run:
        if journal.resume:
            raise UsageError("--dry-run cannot be combined with --resume")
        if checks.file:
            raise UsageError("--dry-run cannot be combined with --baseline")
        plan, _ = _plan(place, options)
        target = node(asking.target, model_behind(place), port_behind(place))
        consent = Consent.of(asking.allow, asking.confirm)
        show_dry_run(output, plan, place, consent, target, with_forecast=True)
        return
    compared = Baseline(checks)
    with run_journal("sweep", journal) as kept:
        if journal.resume and not any(options):
            plan, kept.options = _plan_of_before(place, kept)
        else:
            plan, kept.options = _plan(place, options)
        run_plan(plan, output, connecting, asking, kept, compared)


def _plan(place: DeviceAddress, options: SweepOptions) -> tuple[Plan, dict[str, str]]:
    return plan_of(generation_behind(place), model_behind(place), port_behind(place), options)


def plan_of(
    generation: Generation, robot: Robot | None, port: int, options: SweepOptions
) -> tuple[Plan, dict[str, str]]:
    """Return the plan, and the options that a journal needs to make it again.

    Args:
        generation: the protocol, for names of devices.
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
        options: as typed.

    Raises:
        UsageError: the options contradict each other, or name nothing.
        BadInputFileError: the plan or the capture cannot be used.
    """
    if options.capture is not None:
        if any(other is not None for other in options[:4]):
            raise UsageError("--plan-from cannot be combined with --plan, --did, --cid or --payload")
        return plan_of_capture(options.capture, generation), {
            "plan_from": str(Path(options.capture).absolute())
        }
    if options.plan is not None:
        if any(other is not None for other in (options.did, options.cid, options.payload)):
            raise UsageError("--plan cannot be combined with --did, --cid or --payload")
        if library := library_in(options.plan):
            plan = claims_plan(library, robot, port)
            return plan, {"plan": options.plan}
        plan = find_plan(options.plan)
        if plan.file is None or is_shipped(plan.file):
            return plan, {"plan": plan.file.stem if plan.file else plan.name}
        return plan, {"plan_file": str(plan.file.absolute())}
    if options.did is None:
        raise UsageError("nothing to sweep", "try: sphero-probe sweep --did 0x13, or --plan hello")
    cid = options.cid or "0x00-0xff"
    dids = id_range(options.did, generation, devices=True)
    cids = id_range(cid, generation, devices=False)
    exact = None if options.payload is None else hex_bytes(options.payload, "--payload")
    probes = PackedProbes(probes_of(dids, cids, payload=exact))
    again = {"did": _ids(dids), "cid": _ids(cids)}
    if exact is not None:
        again["payload"] = exact.hex()
    return Plan("sweep", f"DID {options.did}, CID {cid}", [probes]), again


def _ids(ids: tuple[int, ...]) -> str:
    """Return ids as ``--did`` takes them, in their order."""
    return ",".join(spans(ids) if list(ids) == sorted(ids) else (f"0x{one:02x}" for one in ids))


def _plan_of_before(place: DeviceAddress, journal: RunJournal) -> tuple[Plan, dict[str, str]]:
    """Return the plan of an interrupted run; only a shipped plan is run without being named again."""
    if journal.opening is None:
        raise BadInputFileError(
            f"{journal.place}: this journal is still empty", "start a new run: --did 0x13"
        )
    options = journal.opening.options
    if file := options.get("plan_file"):
        raise UsageError(
            "that run used a plan file, which the journal does not contain", f"add --plan {file}"
        )
    if file := options.get("plan_from"):
        raise UsageError(
            "that run used a capture, which the journal does not contain", f"add --plan-from {file}"
        )
    if name := options.get("plan"):
        if library := library_in(name):
            return claims_plan(library, model_behind(place), port_behind(place)), options
        for path in plan_files():
            if path.stem == name:
                return load_plan(path), options
        raise BadInputFileError(f"this version of the tool has no plan {name}, which the journal names")
    asked = SweepOptions(options.get("did"), options.get("cid"), None, options.get("payload"))
    try:
        return _plan(place, asked)
    except UsageError as error:
        raise BadInputFileError(f"the journal does not say what to ask: {error}") from error
