"""``doctor``: check that this machine can reach a robot."""

from collections import Counter

import click

from sphero_probe.cli.evidence_hint import suggest_evidence
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import ConnectOptions, Output
from sphero_probe.diagnostics.checkup import Checkup
from sphero_probe.reports.checks import CHECKS, State, check_row
from sphero_probe.session.addressing import address_of, model_behind
from sphero_probe.transports.base import OpenOptions


def examine(output: Output, connecting: ConnectOptions, timeout: float) -> None:
    """Run every check and print its result as it ends.

    Args:
        output: where and how.
        connecting: which robot to measure, if one is named.
        timeout: seconds for each check of this machine.

    Raises:
        Exit: with code 1, if a check failed.
    """

    def on_step(step: str) -> None:
        if connecting.verbose:
            say(f"{step} ...")

    opening = OpenOptions(connecting.connect_timeout, connecting.adapter, on_step)
    checkup = Checkup(connecting.device, opening, timeout, connecting.tolerate)

    async def work() -> None:
        with report(output, CHECKS) as rows:
            shown = 0
            for part in checkup.parts():
                await checkup.look_safely(part)
                for name, look in checkup.looks[shown:]:
                    rows.add(check_row(name, look))
                shown = len(checkup.looks)

    run_interruptible(Interrupts(), work())
    counts = Counter(look.state for _, look in checkup.looks)
    say(_summary(counts, measured=bool(connecting.device)))
    if counts[State.FAIL]:
        raise click.exceptions.Exit(1)
    if connecting.device:
        suggest_evidence(connecting.device, model_behind(address_of(connecting.device)))


def _summary(counts: Counter[State], *, measured: bool) -> str:
    said = ", ".join(f"{counts[state]} {state.value}" for state in State if counts[state])
    return said if measured else f"{said}; to measure a robot too, add --device ROBOT"
