"""``discover``: map everything that a robot can do, in stages."""

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.naming import id_range
from sphero_probe.cli.baseline import Baseline
from sphero_probe.cli.dry_run import show_dry_run
from sphero_probe.cli.evidence_hint import suggest_evidence
from sphero_probe.cli.journal import run_journal
from sphero_probe.cli.run import run_plan
from sphero_probe.cli.values import AskOptions, CheckOptions, ConnectOptions, JournalOptions, Output
from sphero_probe.errors import UsageError
from sphero_probe.link.policy import Consent
from sphero_probe.probing.open_questions import is_known_firmware
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.plans.discovery import discovery
from sphero_probe.protocol.packets import Generation
from sphero_probe.session.addressing import address_of, generation_behind, model_behind, port_behind
from sphero_probe.session.commands import node


def discover(
    output: Output,
    checks: CheckOptions,
    journal: JournalOptions,
    connecting: ConnectOptions,
    asking: AskOptions,
    did: str | None,
    *,
    lengths: bool,
    values: bool,
) -> None:
    """Map a robot and report it, or show what would be sent.

    Args:
        output: where and how to report.
        checks: what the run must come up to.
        journal: which journal to keep.
        connecting: which robot.
        asking: what is allowed, and of which node.
        did: the devices as typed, None for all.
        lengths: also find the lengths that unknown commands accept.
        values: also try other values.

    Raises:
        SpheroProbeError: the options are not valid, or the run ended early.
    """
    place = address_of(connecting.device)
    target = node(asking.target, model_behind(place), port_behind(place))
    options = {"lengths": str(int(lengths)), "values": str(int(values))} | ({"did": did} if did else {})
    if asking.dry_run:
        if journal.resume:
            raise UsageError("--dry-run cannot be combined with --resume")
        if checks.file:
            raise UsageError("--dry-run cannot be combined with --baseline")
        consent = Consent.of(asking.allow, asking.confirm)
        plan = plan_of(generation_behind(place), target, options)
        show_dry_run(output, plan, place, consent, target, with_forecast=True)
        return
    compared = Baseline(checks)
    with run_journal("discover", journal) as kept:
        if kept.opening and not (did or lengths or values):
            options = dict(kept.opening.options)
        kept.options = options
        plan = plan_of(generation_behind(place), target, options)
        heading = run_plan(plan, output, connecting, asking, kept, compared)
    robot = ROBOTS.get(heading.robot) if heading else None
    if heading and not is_known_firmware(robot, heading.firmware):
        suggest_evidence(connecting.device, robot)


def plan_of(generation: Generation, target: int | None, options: dict[str, str]) -> Plan:
    """Return the plan that maps a robot.

    Args:
        generation: its protocol.
        target: the address byte of its usual node.
        options: as the journal keeps them.

    Raises:
        UsageError: a device id is not valid.
    """
    return discovery(
        generation,
        target,
        dids=id_range(options.get("did", "0x00-0xff"), generation, devices=True),
        lengths=options.get("lengths") == "1",
        values=options.get("values") == "1",
    )
