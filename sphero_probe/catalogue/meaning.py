"""What a packet says: its row in the catalogue and its payload as named fields."""

from functools import lru_cache
from typing import NamedTuple, assert_never

from sphero_probe.catalogue.commands import lookup, notification_row, rows_of
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.payload.layout import Decoded, Layout
from sphero_probe.catalogue.robots import ROBOTS
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import (
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Verdict,
)


class Meaning(NamedTuple):
    """A packet in the words of the catalogue.

    Attributes:
        row: what is known of its ids, None where no catalogue has them.
        decoded: its payload taken apart, None where no layout applies: to an error, or to unknown bytes.
    """

    row: CommandRow | None
    decoded: Decoded | None


def packet_meaning(
    packet: Packet,
    generation: Generation,
    robot: Robot | None = None,
    streams: StreamDecoder | None = None,
) -> Meaning:
    """Return what a packet says; whatever its bytes are, this never raises.

    Args:
        packet: the packet.
        generation: the protocol it was read by.
        robot: the model whose meaning of the pair counts, None where it is not known.
        streams: what reads the robot's sensor streams, None where nobody followed its commands.
    """
    stream = None
    layout: Layout | None
    match packet:
        case Malformed():
            return Meaning(None, None)
        case Request(command=command):
            known = _known(generation, (command.did, command.cid), Kind.COMMAND, robot)
            layout, payload = known.request if known and known.kind is Kind.COMMAND else None, command.payload
        case Response(code=code, payload=payload, did=did, cid=cid):
            known = _known(generation, (did, cid), Kind.COMMAND, robot)
            success = CODECS[generation].verdict(code) is Verdict.OK
            layout = known.response if known and known.kind is Kind.COMMAND and success else None
        case Notification(did=did, cid=cid, payload=payload):
            known = _known(generation, (did, cid), Kind.NOTIFICATION, robot)
            layout = known.response if known and known.kind is Kind.NOTIFICATION else None
            stream = streams.decode(packet) if streams else None
        case _:
            assert_never(packet)
    return Meaning(known, stream or (layout.decode(payload) if layout else None))


def answer_meaning(response: Response, known: CommandRow | None) -> Decoded:
    """Return what a successful answer means; nothing where the catalogue has no layout for it.

    Args:
        response: the answer.
        known: the row of the command that it answers, None where no catalogue has it.
    """
    if known and known.kind is Kind.COMMAND and known.response:
        verdict = CODECS[known.generation].verdict(response.code)
        if verdict is Verdict.OK:
            return known.response.decode(response.payload)
    return Decoded({}, {}, b"", "")


def _known(
    generation: Generation, pair: tuple[int | None, int | None], kind: Kind, robot: Robot | None
) -> CommandRow | None:
    """The catalogue's row of a pair, one in the given role where there is any."""
    return _looked_up(generation, *pair, kind, robot.key if robot else "")


@lru_cache(maxsize=1024)
def _looked_up(
    generation: Generation, did: int | None, cid: int | None, kind: Kind, key: str
) -> CommandRow | None:
    """The same by a robot's key; packets come in streams, so the last ones are kept."""
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
