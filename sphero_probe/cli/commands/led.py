"""``led``: lamps and colours go in, one packet that sets them goes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.complete.offers import offer_lamps
from sphero_probe.cli.options import (
    JournalOptions,
    asking_options,
    device_options,
    journal_options,
    output_options,
)
from sphero_probe.cli.output import Output
from sphero_probe.errors import UsageError

if TYPE_CHECKING:
    from sphero_probe.catalogue.model import Robot
    from sphero_probe.protocol.packets import Command


@click.command("led")
@click.option("--front", metavar="RRGGBB", help="The front lamp (on a Mini: the body).")
@click.option("--back", metavar="RRGGBB", help="The back lamp.")
@click.option(
    "--led",
    "lamps",
    multiple=True,
    metavar="NAME=RRGGBB",
    help="Any lamp by name; may be repeated.",
    shell_complete=offer_lamps,
)
@click.option("--off", is_flag=True, help="Every lamp off that is not named.")
@asking_options
@device_options
@journal_options
@output_options
def command(
    output: Output,
    journal_choice: JournalOptions,
    front: str | None,
    back: str | None,
    lamps: tuple[str, ...],
    off: bool,
    device: str,
    target: str | None,
    allow: tuple[str, ...],
    confirm: str,
    dry_run: bool,
    **connecting: object,
) -> None:
    """Set lamps; names come from the robot's own table.

    Example: sphero-probe led --front ff0000 --back 00f --device fake:bolt-plus
    """
    from sphero_probe.catalogue.risk import Risk
    from sphero_probe.cli.oneshot import send_each, show_dry
    from sphero_probe.cli.output import warn
    from sphero_probe.link.policy import Consent
    from sphero_probe.runs.resume import RunJournal
    from sphero_probe.session.commands import lamp_commands

    wanted = _wanted(front, back, lamps)
    if not wanted and not off:
        raise UsageError("no lamp is named", "try: sphero-probe led --front ff0000, or --off")

    def make(robot: "Robot | None", port: int) -> "tuple[Command, ...]":
        return lamp_commands(wanted, robot, port, target, off=off)

    consent = Consent.of(allow, confirm, Risk.WRITE)  # setting lamps is what was asked for
    if dry_run:
        show_dry(output, device, consent, make)
    else:
        send_each(
            output,
            device,
            consent,
            make,
            RunJournal("led", **journal_choice._asdict(), on_warning=warn),
            **connecting,
        )


def _wanted(front: str | None, back: str | None, lamps: tuple[str, ...]) -> dict[str, tuple[int, int, int]]:
    """Return lamp name -> colour, in the order they were given."""
    from sphero_probe.cli.parse import colour

    wanted = {}
    for name, text in (("front", front), ("back", back)):
        if text is not None:
            wanted[name] = colour(text)
    for lamp in lamps:
        name, equals, text = lamp.partition("=")
        if not equals or not name:
            raise UsageError(f"--led {lamp}: not NAME=RRGGBB", "write --led front=ff0000")
        wanted[name.lower()] = colour(text)
    return wanted
