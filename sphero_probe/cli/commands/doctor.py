"""``doctor``: this machine goes in, and a robot if one is named; what works and what to mend comes out."""

from collections import Counter
from functools import partial
from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import device_options, output_options
from sphero_probe.cli.output import Output

if TYPE_CHECKING:
    from sphero_probe.reports.checks import State


@click.command("doctor")
@click.option(
    "--timeout",
    type=click.FloatRange(min=0.1, max=600),
    default=5.0,
    metavar="SECONDS",
    help="For each look at this machine; a robot's answer gets 1 s of it at most.  [default: 5]",
)
@partial(device_options, unnamed="none is connected to")
@output_options
def command(
    output: Output, device: str, timeout: float, connect_timeout: float, adapter: str, verbose: bool
) -> None:
    """Tell whether this machine can reach a robot, and what to mend.

    A line each: ok, warn, fail or skipped; exit 1 if one failed. Without --device no robot is connected to;
    with it the link to that robot is measured, and for a robot that is not reached over Bluetooth LE, what
    Bluetooth lacks only warns.

    Example: sphero-probe doctor --device BP-1234
    """
    from sphero_probe.cli.output import say
    from sphero_probe.cli.signals import Interrupts, run_interruptible
    from sphero_probe.diagnostics.checkup import Checkup
    from sphero_probe.reports.checks import CHECKS, State, check_row
    from sphero_probe.transports.base import OpenOptions

    def on_step(step: str) -> None:
        if verbose:
            say(f"{step} ...")

    checkup = Checkup(device, OpenOptions(connect_timeout, adapter, on_step), timeout)

    async def work() -> None:
        with output.report(CHECKS) as report:
            shown = 0
            for part in checkup.parts():
                await checkup.look_safely(part)
                for name, look in checkup.looks[shown:]:
                    report.add(check_row(name, look))
                shown = len(checkup.looks)

    run_interruptible(Interrupts(), work())
    counts = Counter(look.state for _, look in checkup.looks)
    click.echo(_summary(counts, measured=bool(device)), err=True)
    if counts[State.FAIL]:
        raise click.exceptions.Exit(1)


def _summary(counts: "Counter[State]", *, measured: bool) -> str:
    from sphero_probe.reports.checks import State

    said = ", ".join(f"{counts[state]} {state.value}" for state in State if counts[state])
    return said if measured else f"{said}; to measure a robot, too: --device ROBOT"
