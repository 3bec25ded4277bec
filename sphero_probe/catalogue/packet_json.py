"""One packet as JSON: the keys that ``decode``, ``listen``, the notes of a run and every report share."""

from functools import lru_cache
from typing import assert_never

from sphero_probe.catalogue.commands import lookup, notification_row, rows_of
from sphero_probe.catalogue.leds import leds_set
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
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


def packet_json(
    packet: Packet,
    generation: Generation,
    raw: bytes,
    robot: Robot | None = None,
    streams: StreamDecoder | None = None,
) -> dict[str, object]:
    """Return the keys of a packet in their order; those that do not apply, or are not known, are left out.

    - ``generation``: ``v1`` or ``v2``
    - ``kind``: ``command``, ``response``, ``notification`` or ``malformed``
    - ``did``, ``cid``, ``seq``: integers; a V1 notification has its async id in ``cid`` and no ``did``
    - ``code``, ``code_name``: of a response, the integer and its documented name
    - ``target``, ``source``: address bytes, as integers
    - ``name``: as the catalogue knows it
    - ``fields``, ``units``: the decoded payload, by the catalogue's layout or, for a sensor stream, by the
      masks or the services that were set
    - ``leds``: those that a command sets, lamp name -> colour, where the robot is known
    - ``payload``, ``raw``: the data bytes and the whole frame, in lower-case hex
    - ``note``: what does not fit the layout
    - ``reason``: why bytes are malformed; they have ``generation``, ``kind`` and ``raw`` besides

    Args:
        packet: the packet.
        generation: the protocol it was read by.
        raw: its frame.
        robot: the model whose meaning of the pair counts, None where it is not known.
        streams: what reads the robot's sensor streams, None where nobody followed its commands.
    """
    keys: dict[str, object]
    stream = lamps = None
    match packet:
        case Malformed(raw=held, reason=reason):
            return {
                "generation": generation.value,
                "kind": "malformed",
                "raw": (raw or held).hex(),
                "reason": reason,
            }
        case Request(command=Command(did, cid, payload, target), seq=seq, source=source):
            known = _known(generation, (did, cid), Kind.COMMAND, robot)
            layout = known.request if known and known.kind is Kind.COMMAND else None
            keys = {"kind": "command", "did": did, "cid": cid, "seq": seq}
            lamps = leds_set(robot, packet.command) if robot else None
        case Response(seq, code, payload, did, cid, source, target):
            known = _known(generation, (did, cid), Kind.COMMAND, robot)
            codec = CODECS[generation]
            success = codec.verdict(code) is Verdict.OK
            layout = known.response if known and known.kind is Kind.COMMAND and success else None
            keys = {"kind": "response", "did": did, "cid": cid, "seq": seq, "code": code}
            keys["code_name"] = codec.code_name(code)
        case Notification(did, cid, payload, source, target, seq):
            known = _known(generation, (did, cid), Kind.NOTIFICATION, robot)
            layout = known.response if known and known.kind is Kind.NOTIFICATION else None
            stream = streams.decode(packet) if streams else None
            keys = {"kind": "notification", "did": did, "cid": cid, "seq": seq}
        case _:
            assert_never(packet)
    decoded = stream or (layout.decode(payload) if layout else None)
    keys |= {
        "target": target,
        "source": source,
        "name": known.name if known else None,
        "fields": decoded.fields if decoded else None,
        "units": decoded.units or None if decoded else None,
        "leds": lamps,
        "payload": payload.hex(),
        "raw": raw.hex(),
        "note": decoded.problem or None if decoded else None,
    }
    present = {key: value for key, value in keys.items() if value is not None}
    return {"generation": generation.value} | present


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
