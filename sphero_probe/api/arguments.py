"""Converts the arguments of API methods: commands, ids, nodes and colours, by name or by number."""

from collections.abc import Iterable, Sequence
from typing import Any

from sphero_probe.catalogue.leds import Colour
from sphero_probe.catalogue.naming import byte, colour, id_range, pair
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import UsageError
from sphero_probe.protocol.packets import Command, Generation
from sphero_probe.session.commands import complete_command
from sphero_probe.transports.base import Connection

Ids = int | str | Iterable[int | str]
"""One id or several: ``0x13``, ``"power"``, ``"0x10-0x1a,0x1f"``, ``range(256)``, ``["power", 0x11]``."""


def command_of(
    connection: Connection,
    what: str | int | Command,
    cid: int | None,
    payload: bytes | None,
    target: str | int | None,
) -> Command:
    """Return the command that the arguments of ``ConnectedRobot.send`` name, with its node.

    Raises:
        UsageError: there is no such command or node, or the command takes arguments.
    """
    match what:
        case Command():
            if cid is not None or payload is not None:
                raise UsageError("a Command has its CID and payload already", "leave the others out")
            ids, payload = (what.did, what.cid), what.payload
            target = what.target if target is None else target
        case str():
            if cid is not None:
                raise UsageError(f"'{what}' names a whole command", "leave the CID out")
            ids = pair(what, connection.generation)
        case _:
            if cid is None:
                raise UsageError("a DID alone is not a command", "write: send(0x13, 0x10)")
            ids = (what, cid)
    for one, word in zip(ids, ("DID", "CID"), strict=True):
        byte(str(one), word)
    command = complete_command(
        *(ids, payload, connection.robot, connection.port, node_text(target)),
        generation=connection.generation,
    )
    return command._replace(options=what.options) if isinstance(what, Command) else command


def ids_of(ids: Ids, generation: Generation, *, devices: bool) -> tuple[int, ...]:
    """Return the named ids in order, each once.

    Args:
        ids: numbers, names, or ranges as text.
        generation: the protocol that the names belong to.
        devices: whether they are device ids rather than command ids.

    Raises:
        UsageError: one is not an id.
    """
    parts: Iterable[Any] = (ids,) if isinstance(ids, int | str) else ids
    return tuple(
        dict.fromkeys(one for part in parts for one in id_range(str(part), generation, devices=devices))
    )


def ids_text(ids: Sequence[int]) -> str:
    """Return ids as ``--did`` and ``--cid`` take them."""
    return ",".join(f"0x{one:02x}" for one in ids)


def node_text(target: str | int | None) -> str | None:
    """Return a node as ``--target`` takes it."""
    return target if target is None or isinstance(target, str) else str(target)


def colour_of(color: str | Colour) -> Colour:
    """Return red, green and blue of a colour.

    Raises:
        UsageError: it is not a colour.
    """
    if isinstance(color, str):
        return colour(color)
    red, green, blue = (byte(str(part), "colour") for part in color)
    return red, green, blue


def how_to_allow(risk: Risk) -> str:
    """Return the hint that says how to allow a risk class."""
    if risk is Risk.BRICK:
        return "allow it with connect(…, consent=Consent.of(['brick'], confirm=NAME-OF-ROBOT))"
    return f"allow it with connect(…, consent=[{risk.word!r}])"
