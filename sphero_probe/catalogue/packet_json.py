"""One packet as JSON: the keys that ``decode``, ``listen``, the notes of a run and every report share."""

from collections.abc import Collection, Iterable, Mapping
from typing import Final, NamedTuple

from sphero_probe.catalogue.addresses import Use, address_meaning
from sphero_probe.catalogue.leds import leds_set
from sphero_probe.catalogue.meaning import payload_layout
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.payload.layout import Layout
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
USUAL: Final = ("seq", "fields", "payload", "raw")
"""The keys that vary from packet to packet, where all is known and nothing is odd."""
_SIMPLE: Final = ("seq", "payload", "raw")
_new: Final = tuple.__new__  # a NamedTuple's own __new__ costs twice as much
_MOST: Final = 4096
"""The most headers that are remembered."""


class SharedKeys:
    """The keys of many packets with the same ids, addresses, flags and code; compared by identity.

    Attributes:
        names: every key, in order.
        fixed: key -> value, for those that are the same in all these packets.
        varying: the other keys, in order.
        simple: those of them that hold whole numbers, or text of ASCII letters and digits: nothing to escape.
    """

    __slots__ = ("fixed", "names", "simple", "varying")

    def __init__(
        self, names: Iterable[str], fixed: Mapping[str, object], simple: Collection[str] = ()
    ) -> None:
        self.names, self.fixed = tuple(names), fixed
        self.varying = tuple(name for name in self.names if name not in fixed)
        self.simple = frozenset(simple).intersection(self.varying)

    def data(self, values: Iterable[object]) -> dict[str, object]:
        """Return all keys with their values, given those of the varying keys in order."""
        rest, fixed = iter(values), self.fixed
        return {name: fixed[name] if name in fixed else next(rest) for name in self.names}


class PacketKeys(NamedTuple):
    """The keys of a packet, and what they hold.

    Attributes:
        keys: the same object for packets that share most of their values.
        values: of the varying keys, in order.
    """

    keys: SharedKeys
    values: tuple[object, ...]

    @property
    def all(self) -> dict[str, object]:
        """The keys as ``packet_json`` returns them."""
        return self.keys.data(self.values)


class _Header:
    """What the ids, addresses, flags and code of a packet say: the same for most packets of a stream.

    Attributes:
        layout: of the payload, None where it is not known.
        usual: the keys of packets that vary in ``USUAL``.
    """

    def __init__(self, before: dict[str, object], after: dict[str, object], layout: Layout | None) -> None:
        """Take the keys before ``seq``, those between ``seq`` and ``fields``, and the layout."""
        self._before, self._after, self._fixed = before, after, before | after
        self._of: dict[tuple[str, ...], SharedKeys] = {}
        self.layout = layout
        self.usual = self.keys(USUAL)

    def keys(self, varying: tuple[str, ...]) -> SharedKeys:
        """Return the keys of packets that vary in these keys; ``seq``, if it is one, is the first."""
        if varying not in self._of:
            split = varying.count("seq")
            names = (*self._before, *varying[:split], *self._after, *varying[split:])
            self._of[varying] = SharedKeys(names, self._fixed, _SIMPLE)
        return self._of[varying]


_headers: dict[tuple[object, ...], _Header] = {}
_MALFORMED: Final = {
    generation: SharedKeys(
        ("generation", "kind", "raw", "reason"),
        {"generation": generation.value, "kind": "malformed"},
        _SIMPLE,
    )
    for generation in Generation
}


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
    return packet_keys(packet, generation, raw, robot, streams).all


def packet_keys(
    packet: Packet,
    generation: Generation,
    raw: bytes,
    robot: Robot | None = None,
    streams: StreamDecoder | None = None,
    *,
    raw_floats: bool = False,
) -> PacketKeys:
    """Return the keys of a packet, apart from what many packets share.

    The arguments are those of ``packet_json`` and, for the payload, of ``Layout.decode``.
    """
    leds = stream = None
    model = robot.key if robot else ""
    cid: int | None
    if isinstance(packet, Notification):
        did, cid, payload, source, target, seq, flags = packet
        of_header: tuple[object, ...] = (generation, model, did, cid, source, target, flags)
        stream = streams.decode(packet) if streams and streams.is_set_up else None
    elif isinstance(packet, Response):
        seq, code, payload, did, cid, source, target, flags = packet
        of_header = (generation, model, did, cid, source, target, flags, code)
    elif isinstance(packet, Request):
        command, seq, source, flags, _ = packet
        did, cid, payload, target, _ = command
        of_header = (generation, model, did, cid, source, target, flags, None, None)
        leds = leds_set(robot, packet.command) if robot else None
    else:
        return _malformed(packet, generation, raw)
    header = _headers.get(of_header)
    if header is None:
        if len(_headers) >= _MOST:
            _headers.clear()
        header = _headers[of_header] = _header(packet, generation, robot)
    decoded = stream or (header.layout.decode(payload, raw_floats=raw_floats) if header.layout else None)
    if decoded and seq is not None and leds is None:
        fields, units, _, problem = decoded
        if not (units or problem):  # most packets of a stream
            return _new(PacketKeys, (header.usual, (seq, fields, payload.hex(), raw.hex())))
    varying: dict[str, object] = {} if seq is None else {"seq": seq}
    if decoded:
        varying["fields"] = decoded.fields
        if decoded.units:
            varying["units"] = decoded.units
    if leds is not None:
        varying["leds"] = leds
    varying |= {"payload": payload.hex(), "raw": raw.hex()}
    if decoded and decoded.problem:
        varying["note"] = decoded.problem
    return PacketKeys(header.keys(tuple(varying)), tuple(varying.values()))


def _malformed(packet: Malformed, generation: Generation, raw: bytes) -> PacketKeys:
    return PacketKeys(_MALFORMED[generation], ((raw or packet.raw).hex(), packet.reason))


def _header(
    packet: Request | Response | Notification, generation: Generation, robot: Robot | None
) -> _Header:
    codec, uses, after = CODECS[generation], _ANSWER_USES, dict[str, object]()
    match packet:
        case Request(command=Command(did, cid, _, target), source=source):
            kind, uses = "command", _COMMAND_USES
        case Response(code=code, did=did, cid=cid, source=source, target=target):
            kind = "response"
            after = {"code": code, "code_name": codec.code_name(code)}
        case Notification(did=did, cid=cid, source=source, target=target):
            kind = "notification"
    names = codec.flag_names(packet)
    known, layout = payload_layout(packet, generation, robot)
    before = _present({"generation": generation.value, "kind": kind, "did": did, "cid": cid})
    after |= {
        "target": target,
        "source": source,
        "target_means": None if target is None else address_meaning(target, uses[0], robot).words,
        "source_means": None if source is None else address_meaning(source, uses[1], robot).words,
        "flags": None if names is None else list(names),
        "name": known.name if known else None,
    }
    after = _present(after)
    return _Header(before, after, layout)


def _present(keys: dict[str, object]) -> dict[str, object]:
    return {key: value for key, value in keys.items() if value is not None}
