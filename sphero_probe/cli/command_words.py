"""Reading one command that was typed as words, for ``send`` and ``listen --send``."""

from sphero_probe.catalogue import lookup
from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.parse import command_id, device_id, hex_bytes, node, pair
from sphero_probe.errors import UsageError
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command, Generation


def parse_command(what: tuple[str, ...], generation: Generation) -> tuple[int, int, bytes | None]:
    """Return DID, CID and argument bytes (None where none are given) of words.

    Args:
        what: ``0x13 0x10 [HEX]``, ``0x13:0x10 [HEX]`` or ``NAME [HEX]``.
        generation: the protocol whose names count.

    Raises:
        UsageError: it makes no sense.
    """
    if not what:
        raise UsageError("send what?", "write: send 0x13 0x10")
    first, *rest = what
    if first[:1].isdigit() and ":" not in first:
        if not rest:
            raise UsageError("send what? a DID alone is no command", "write: send 0x13 0x10")
        did, cid = device_id(first, generation), command_id(rest.pop(0), generation)
    else:
        did, cid = pair(first, generation)
    return did, cid, hex_bytes(" ".join(rest), "payload") if rest else None


def complete(
    asked: tuple[int, int, bytes | None], robot: Robot | None, port: int, target: str | None
) -> Command:
    """Return the command with its node; without argument bytes it must be one that takes none.

    Args:
        asked: what ``parse_command`` returned.
        robot: the model, None where it is not known.
        port: the port nibble on this kind of line.
        target: the node as it was typed, None for the one that serves the command.

    Raises:
        UsageError: it takes arguments, or there is no node of that name.
    """
    did, cid, payload = asked
    row = lookup(robot.generation if robot else Generation.V2, did, cid, robot)
    address = node(target, robot, port)
    if target is None and address is not None and robot and row and (nodes := row.nodes.get(robot.key)):
        address = Address(port, nodes[0]).byte
    if payload is None and row and row.request and not row.request.accepts(0):
        raise UsageError(
            f"{row.name} takes arguments: {row.request.text}", "give them as hex bytes after the command"
        )
    return Command(did, cid, payload or b"", address)
