"""One packet as JSON: the keys that ``decode``, ``listen``, the notes of a run and every report share."""

from typing import Final, assert_never

from sphero_probe.catalogue.addresses import Use, address_meaning
from sphero_probe.catalogue.leds import leds_set
from sphero_probe.catalogue.meaning import packet_meaning
from sphero_probe.catalogue.model import Robot
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
)

_COMMAND_USES: Final = (Use.COMMAND_TARGET, Use.COMMAND_SOURCE)
_ANSWER_USES: Final = (Use.ANSWER_TARGET, Use.ANSWER_SOURCE)


def packet_json(
    packet: Packet,
    generation: Generation,
    raw: bytes,
    robot: Robot | None = None,
    streams: StreamDecoder | None = None,
) -> dict[str, object]:
    """Return the keys of a packet in a fixed order; keys that do not apply, or are not known, are left out.

    - ``generation``: ``v1`` or ``v2``
    - ``kind``: ``command``, ``response``, ``notification`` or ``malformed``
    - ``did``, ``cid``, ``seq``: integers; a V1 notification has its async id in ``cid`` and no ``did``
    - ``code``, ``code_name``: the code of a response, as an integer and by its documented name
    - ``target``, ``source``: address bytes, as integers
    - ``target_means``, ``source_means``: the same in words
    - ``flags``: the names of those that are set; in V1, the options of a command
    - ``name``: the name in the catalogue
    - ``fields``, ``units``: the decoded payload, by the catalogue's layout or, for a sensor stream, by the
      masks or the services that were set
    - ``leds``: the LEDs that a command sets, LED name -> colour, where the robot is known
    - ``payload``, ``raw``: the data bytes and the whole frame, in lower-case hex
    - ``note``: what does not fit the layout
    - ``reason``: why bytes are malformed; their other keys are ``generation``, ``kind`` and ``raw``

    Args:
        packet: the packet.
        generation: the protocol it was read by.
        raw: its frame.
        robot: the model, None where it is not known.
        streams: the decoder of the robot's sensor streams, None where its commands were not followed.
    """
    keys: dict[str, object]
    leds = None
    match packet:
        case Malformed(raw=held, reason=reason):
            return {
                "generation": generation.value,
                "kind": "malformed",
                "raw": (raw or held).hex(),
                "reason": reason,
            }
        case Request(command=Command(did, cid, payload, target), seq=seq, source=source):
            keys = {"kind": "command", "did": did, "cid": cid, "seq": seq}
            leds = leds_set(robot, packet.command) if robot else None
        case Response(seq, code, payload, did, cid, source, target):
            keys = {"kind": "response", "did": did, "cid": cid, "seq": seq, "code": code}
            keys["code_name"] = CODECS[generation].code_name(code)
        case Notification(did, cid, payload, source, target, seq):
            keys = {"kind": "notification", "did": did, "cid": cid, "seq": seq}
        case _:
            assert_never(packet)
    uses = _COMMAND_USES if isinstance(packet, Request) else _ANSWER_USES
    names = CODECS[generation].flag_names(packet)
    known, decoded = packet_meaning(packet, generation, robot, streams)
    keys |= {
        "target": target,
        "source": source,
        "target_means": None if target is None else address_meaning(target, uses[0], robot).words,
        "source_means": None if source is None else address_meaning(source, uses[1], robot).words,
        "flags": None if names is None else list(names),
        "name": known.name if known else None,
        "fields": decoded.fields if decoded else None,
        "units": decoded.units or None if decoded else None,
        "leds": leds,
        "payload": payload.hex(),
        "raw": raw.hex(),
        "note": decoded.problem or None if decoded else None,
    }
    present = {key: value for key, value in keys.items() if value is not None}
    return {"generation": generation.value} | present
