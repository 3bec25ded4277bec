"""``send``: one command's ids or name and its bytes go in, the answer comes out."""

from typing import TYPE_CHECKING

import click

from sphero_probe.cli.options import asking_options, device_options, output_options
from sphero_probe.cli.output import Output
from sphero_probe.errors import UsageError

if TYPE_CHECKING:
    from sphero_probe.catalogue.model import Robot
    from sphero_probe.protocol.packets import Command


@click.command("send")
@click.argument("what", nargs=-1, required=True, metavar="DID CID [HEX] | NAME [HEX]")
@asking_options
@device_options
@output_options
def command(
    output: Output,
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
    from sphero_probe.catalogue.model import Robot
    from sphero_probe.cli.session import consent_of
    from sphero_probe.cli.single import send_single, show_dry
    from sphero_probe.protocol.packets import Command

    did, cid, payload = _parse(what)

    def make(robot: Robot | None, port: int) -> Command:
        return _complete(Command(did, cid, payload or b""), robot, port, target, given=payload is not None)

    consent = consent_of(allow, confirm)
    if dry_run:
        show_dry(output, device, consent, make)
    else:
        send_single(output, device, consent, make, **connecting)


def _parse(what: tuple[str, ...]) -> tuple[int, int, bytes | None]:
    """Take apart ``0x13 0x10 [HEX]``, ``0x13:0x10 [HEX]`` or ``NAME [HEX]``."""
    from sphero_probe.cli.words import command_id, device_id, hex_bytes, pair
    from sphero_probe.protocol.packets import Generation

    first, *rest = what
    if first[:1].isdigit() and ":" not in first:
        if not rest:
            raise UsageError("send what? a DID alone is no command", "write: send 0x13 0x10")
        did, cid = device_id(first, Generation.V2), command_id(rest.pop(0), Generation.V2)
    else:
        did, cid = pair(first, Generation.V2)
    return did, cid, hex_bytes("".join(rest), "payload") if rest else None


def _complete(
    command: "Command", robot: "Robot | None", port: int, target: str | None, *, given: bool
) -> "Command":
    """Fill in the node, and the arguments that a documented read is asked with."""
    from sphero_probe.catalogue import lookup
    from sphero_probe.cli.words import node
    from sphero_probe.protocol.packets import Generation

    row = lookup(Generation.V2, command.did, command.cid, robot)
    address = node(target, robot, port)
    if target is None and address is not None and robot and row and (nodes := row.nodes.get(robot.key)):
        address = port << 4 | nodes[0]
    command = command._replace(target=address)
    if given or row is None or row.request is None or row.request.accepts(0):
        return command
    raise UsageError(
        f"{row.name} takes arguments: {row.request.text}", "give them as hex bytes after the command"
    )
