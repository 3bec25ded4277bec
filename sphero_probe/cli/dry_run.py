"""Shows what a run would send, without connecting to the robot."""

import click

from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.link.policy import Consent
from sphero_probe.probing.dry_run import planned_probes
from sphero_probe.probing.plan import Plan
from sphero_probe.reports.rows import planned_row
from sphero_probe.reports.views import PLANNED
from sphero_probe.session.addressing import generation_behind, model_behind
from sphero_probe.transports.registry import DeviceAddress


def show_dry_run(
    output: Output, plan: Plan, address: DeviceAddress, consent: Consent, target: int | None
) -> None:
    """Show the bytes that a run would send; print on standard error what a dry run leaves out.

    Args:
        output: where and how to print.
        plan: what would be asked.
        address: the robot's.
        consent: what is allowed.
        target: the address byte of the node, None to leave addresses out.
    """
    click.echo(
        "dry run: nothing is sent. A real run first wakes the robot, reads its firmware version and\n"
        "measures whether it rejects wrong lengths; if it does not, unknown commands are blocked.",
        err=True,
    )
    robot = model_behind(address)
    probes = planned_probes(plan, generation_behind(address), robot, consent, target)
    show(output, PLANNED, map(planned_row, probes))
