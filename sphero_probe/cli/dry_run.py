"""Shows what a run would send, without connecting to the robot."""

from collections import Counter
from collections.abc import Iterable, Iterator
from math import ceil
from typing import Final

import click

from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.values import Output
from sphero_probe.link.policy import Consent
from sphero_probe.probing.dry_run import FASTEST, SLOWEST, PlannedProbe, planned_probes
from sphero_probe.probing.plan import Plan
from sphero_probe.reports.rows import planned_row
from sphero_probe.reports.views import PLANNED
from sphero_probe.session.addressing import generation_behind, model_behind, name_behind
from sphero_probe.transports.registry import DeviceAddress

_LINKS: Final = (
    (FASTEST, "on a fast Bluetooth link"),
    (SLOWEST, "with the answer times measured on a Sphero Mini"),
)
"""Seconds per probe, and on which link."""


def show_dry_run(
    output: Output,
    plan: Plan,
    address: DeviceAddress,
    consent: Consent,
    target: int | None,
    *,
    with_forecast: bool = False,
) -> None:
    """Show the bytes that a run would send; print on standard error what a dry run leaves out.

    Args:
        output: where and how to print.
        plan: what would be asked.
        address: the robot's.
        consent: what is allowed.
        target: the address byte of the node, None to leave addresses out.
        with_forecast: also print how many probes there are, and estimate how long the run takes.
    """
    say_dry_run("the robot")
    robot, name = model_behind(address), name_behind(address)
    probes = planned_probes(plan, generation_behind(address), robot, consent, target, name)
    blocked = Counter[bool]()

    def counted() -> Iterator[PlannedProbe]:
        for probe in probes:
            blocked[probe.blocked is not None] += 1
            yield probe

    show(output, PLANNED, map(planned_row, counted()))
    if with_forecast:
        for line in forecast_lines(plan, blocked[False], blocked[True]):
            say(line)


def say_dry_run(whom: str) -> None:
    """Print on standard error what a dry run leaves out.

    Args:
        whom: ``the robot``, or ``each robot``.
    """
    click.echo(
        f"dry run: nothing is sent. A real run first wakes {whom}, reads its firmware version and\n"
        "measures whether it rejects wrong lengths; if it does not, unknown commands are blocked.",
        err=True,
    )


def forecast_lines(plan: Plan, sent: int, blocked: int) -> Iterator[str]:
    """Yield how many probes a run sends, as far as that is known before, and how long that takes.

    Args:
        plan: what would be asked.
        sent: how many of its known probes would be sent.
        blocked: how many of them would be blocked.
    """
    count = count_of(sent, blocked)
    if not plan.open_stages:
        times = (f"{_about(sent * seconds)} {link}" for seconds, link in _LINKS)
        yield f"{count}. Estimated time: {', '.join(times)}."
        return
    yield f"{count}; {what_follows(plan.open_stages)}."
    for seconds, link in _LINKS:
        known, further = _about(sent * seconds), _about(1000 * seconds)
        yield f"Estimated time {link}: {known}, and {further} for each 1000 that follow."


def count_of(sent: int, blocked: int) -> str:
    """Return how many probes would be sent, and how many blocked, in words."""
    return f"{sent} probe{'s' * (sent != 1)} to send" + (f", {blocked} blocked" if blocked else "")


def what_follows(stages: Iterable[str]) -> str:
    """Return that more probes follow in the stages that are made from findings."""
    return f"more follow from what is found ({', '.join(stages)})"


def _about(seconds: float) -> str:
    """Return a rough duration, ``5 s`` or ``20 min``."""
    if seconds < 90:
        return f"{max(1, ceil(seconds))} s"
    return f"{ceil(seconds / 60)} min"
