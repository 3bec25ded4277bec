"""``send``: one command's ids or name and its bytes go in, the answer comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.complete.offers import offer_commands
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
    from sphero_probe.protocol.packets import Command, Generation


@click.command("send")
@click.argument(
    "what", nargs=-1, required=True, metavar="DID CID [HEX] | NAME [HEX]", shell_complete=offer_commands
)
@asking_options
@device_options
@journal_options
@output_options
def command(
    output: Output,
    journal_choice: JournalOptions,
    what: tuple[str, ...],
    device: str,
    target: str | None,
    allow: tuple[str, ...],
    confirm: str,
    dry_run: bool,
    **connecting: object,
) -> None:
    """Send one command and show the answer.

    What changes anything needs its class: --allow write, motion, persist or brick.

    Example: sphero-probe send power.get_battery_percentage --device fake:bolt-plus
    """
    from sphero_probe.cli.oneshot import send_each, show_dry
    from sphero_probe.cli.output import warn
    from sphero_probe.link.policy import Consent
    from sphero_probe.runs.resume import RunJournal
    from sphero_probe.session.addressing import address_of, generation_behind

    asked = parse_command(what, generation_behind(address_of(device)))

    def make(robot: "Robot | None", port: int) -> "tuple[Command, ...]":
        return (complete(asked, robot, port, target),)

    consent = Consent.of(allow, confirm)
    if dry_run:
        show_dry(output, device, consent, make)
    else:
        send_each(
            output,
            device,
            consent,
            make,
            RunJournal("send", **journal_choice._asdict(), on_warning=warn),
            **connecting,
        )


def parse_command(what: tuple[str, ...], generation: "Generation") -> tuple[int, int, bytes | None]:
    """Return DID, CID and argument bytes (None where none are given) of words.

    Args:
        what: ``0x13 0x10 [HEX]``, ``0x13:0x10 [HEX]`` or ``NAME [HEX]``.
        generation: whose names count.

    Raises:
        UsageError: it makes no sense.
    """
    from sphero_probe.cli.parse import command_id, device_id, hex_bytes, pair

    if not what:
        raise UsageError("send what?", "write: send 0x13 0x10")
    first, *rest = what
    if first[:1].isdigit() and ":" not in first:
        if not rest:
            raise UsageError("send what? a DID alone is no command", "write: send 0x13 0x10")
        did, cid = device_id(first, generation), command_id(rest.pop(0), generation)
    else:
        did, cid = pair(first, generation)
    return did, cid, hex_bytes("".join(rest), "payload") if rest else None


def complete(
    asked: tuple[int, int, bytes | None], robot: "Robot | None", port: int, target: str | None
) -> "Command":
    """Return the command with its node; without argument bytes it must be one that takes none.

    Raises:
        UsageError: it takes arguments, or there is no node of that name.
    """
    from sphero_probe.session.commands import complete_command

    did, cid, payload = asked
    return complete_command((did, cid), payload, robot, port, target)
