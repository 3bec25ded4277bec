"""Decodes a packet: finds its row in the catalogue and reads its payload as named fields."""

from functools import lru_cache
from typing import NamedTuple, assert_never

from sphero_probe.catalogue.commands import lookup, notification_row, rows_of
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.payload.layout import Decoded, Layout
from sphero_probe.catalogue.robots import ROBOTS
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Verdict,
)


class Meaning(NamedTuple):
    """What the catalogue says about a packet.

    Attributes:
        row: the row of its ids, None where the catalogue has none.
        decoded: its payload, None where no layout applies, as for an error or for unknown bytes.
    """

    row: CommandRow | None
    decoded: Decoded | None


def packet_meaning(
    packet: Packet,
    generation: Generation,
    robot: Robot | None = None,
    streams: StreamDecoder | None = None,
) -> Meaning:
    """Return what a packet says; no packet makes this raise.

    Args:
        packet: the packet.
        generation: the protocol it was read by.
        robot: the model, None where it is not known.
        streams: the decoder of the robot's sensor streams, None where its commands were not followed.
    """
    if isinstance(packet, Malformed):
        return Meaning(None, None)
    known, layout = payload_layout(packet, generation, robot)
    payload = packet.command.payload if isinstance(packet, Request) else packet.payload
    stream = streams.decode(packet) if streams and isinstance(packet, Notification) else None
    return Meaning(known, stream or (layout.decode(payload) if layout else None))


def payload_layout(
    packet: Request | Response | Notification, generation: Generation, robot: Robot | None
) -> tuple[CommandRow | None, Layout | None]:
    """Return the row of a packet's ids, and the layout of its payload; None where the catalogue has none."""
    match packet:
        case Request(command=command):
            known = _known(generation, (command.did, command.cid), Kind.COMMAND, robot)
            return known, known.request if known and known.kind is Kind.COMMAND else None
        case Response(code=code, did=did, cid=cid):
            known = _known(generation, (did, cid), Kind.COMMAND, robot)
            success = CODECS[generation].verdict(code) is Verdict.OK
            return known, known.response if known and known.kind is Kind.COMMAND and success else None
        case Notification(did=did, cid=cid):
            known = _known(generation, (did, cid), Kind.NOTIFICATION, robot)
            return known, known.response if known and known.kind is Kind.NOTIFICATION else None
    assert_never(packet)


def answer_meaning(response: Response, known: CommandRow | None) -> Decoded:
    """Return the decoded payload of a successful response; empty where the catalogue has no layout for it.

    Args:
        response: the response.
        known: the row of its command, None where the catalogue has none.
    """
    if known and known.kind is Kind.COMMAND and known.response:
        verdict = CODECS[known.generation].verdict(response.code)
        if verdict is Verdict.OK:
            return known.response.decode(response.payload)
    return Decoded({}, {}, b"", "")


def request_fields(command: Command, known: CommandRow | None) -> dict[str, object] | None:
    """Return the decoded arguments of a command, None where the catalogue has no layout that fits them.

    Args:
        command: the command.
        known: its row, None where the catalogue has none.
    """
    if known is None or known.kind is not Kind.COMMAND or known.request is None:
        return None
    decoded = known.request.decode(command.payload)
    return None if decoded.problem else decoded.fields


def _known(
    generation: Generation, pair: tuple[int | None, int | None], kind: Kind, robot: Robot | None
) -> CommandRow | None:
    """Return the row of a pair, preferably one of the given kind."""
    return _looked_up(generation, *pair, kind, robot.key if robot else "")


@lru_cache(maxsize=1024)
def _looked_up(
    generation: Generation, did: int | None, cid: int | None, kind: Kind, key: str
) -> CommandRow | None:
    """As ``_known``, by the robot's key; cached, because streams repeat the same packets."""
    robot = ROBOTS.get(key)
    if cid is None:
        return None
    if kind is Kind.NOTIFICATION:
        return notification_row(generation, did, cid, robot)
    if did is None:
        return None
    fitting = (row for row in rows_of(generation, did, cid) if row.kind is kind)
    likely = lookup(generation, did, cid, robot)
    return likely if likely is None or likely.kind is kind else next(fitting, likely)
