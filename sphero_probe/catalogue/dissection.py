"""A packet taken apart: its frame in, one part per byte out, with field, value and meaning.

The parts joined give the frame again, so that nothing is left out. It follows the worked example of the BOLT+
reference.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

from sphero_probe.catalogue.addresses import Use, address_meaning
from sphero_probe.catalogue.commands import DEVICE_NAMES
from sphero_probe.catalogue.meaning import Meaning, packet_meaning
from sphero_probe.catalogue.model import Robot
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Malformed, Notification, Packet, Request, Response
from sphero_probe.protocol.v2_frames import ESC


class Part(NamedTuple):
    """One byte of a packet, with its escape where it has one.

    Attributes:
        offset: of the first raw byte in the frame.
        raw: the one or two bytes as they are sent.
        field: its name: ``FLAGS``, ``DATA[0]``; empty in a malformed frame.
        value: the byte it stands for, None where it is a marker or part of a malformed frame.
        meaning: in words, or empty.
    """

    offset: int
    raw: bytes
    field: str
    value: int | None
    meaning: str


_START: Final = "start of packet"
_ESCAPED: Final = "escaped: 0x{:02x} & ~0x88 = 0x{:02x}"


def dissect(packet: Packet, generation: Generation, raw: bytes, robot: Robot | None = None) -> list[Part]:
    """Return the parts of a packet in their order.

    Args:
        packet: as the generation's decoder read it.
        generation: the protocol.
        raw: its frame.
        robot: the model whose meaning of ids and nodes counts, None where it is not known.
    """
    if isinstance(packet, Malformed):
        reasons = [packet.reason] + [""] * len(raw)
        return [Part(at, bytes([byte]), "", None, reasons[at]) for at, byte in enumerate(raw)]
    meaning = packet_meaning(packet, generation, robot)
    if CODECS[generation].has_addresses:
        named = list(_v2_fields(packet, generation, meaning, robot))
        return _framed(named, raw)
    return _plain(list(_v1_fields(packet, generation, meaning, raw)), raw)


def _framed(fields: list[tuple[str, str]], raw: bytes) -> list[Part]:
    """Return the parts of a V2 frame: the escapes undone, and between the markers one field a byte."""
    parts = [Part(0, raw[:1], "SOP", None, _START)]
    at, total = 1, 0
    for name, meaning in [*fields, ("CHK", "")]:
        size = 2 if raw[at] == ESC else 1
        value = raw[at + 1] | 0x88 if size == 2 else raw[at]
        words = _checksum(total) if name == "CHK" else meaning
        if size == 2:
            words = "; ".join(filter(None, (words, _ESCAPED.format(value, raw[at + 1]))))
        parts.append(Part(at, raw[at : at + size], name, value, words))
        at, total = at + size, total + value
    return [*parts, Part(at, raw[at:], "EOP", None, "end of packet")]


def _plain(fields: list[tuple[str, str]], raw: bytes) -> list[Part]:
    """Return the parts of a V1 frame, which has no escapes; its checksum leaves both start bytes out."""
    fields.append(("CHK", _checksum(sum(raw[2:-1]))))
    return [Part(at, raw[at : at + 1], name, raw[at], words) for at, (name, words) in enumerate(fields)]


def _checksum(total: int) -> str:
    low = total & 0xFF
    return f"sum 0x{total:x}; 0xff - 0x{low:02x} = 0x{0xFF - low:02x}"


def _v2_fields(
    packet: Request | Response | Notification, generation: Generation, meaning: Meaning, robot: Robot | None
) -> Iterator[tuple[str, str]]:
    codec = CODECS[generation]
    names = codec.flag_names(packet) or ()
    yield "FLAGS", ", ".join(name for name in names if not name.startswith("extended_")) or "none"
    if "extended" in names:
        yield "EXT", ", ".join(name for name in names if name.startswith("extended_")) or "none"
    is_command = isinstance(packet, Request)
    target = packet.command.target if isinstance(packet, Request) else packet.target
    if target is not None:
        use = Use.COMMAND_TARGET if is_command else Use.ANSWER_TARGET
        yield "TID", address_meaning(target, use, robot).words
    if packet.source is not None:
        use = Use.COMMAND_SOURCE if is_command else Use.ANSWER_SOURCE
        yield "SID", address_meaning(packet.source, use, robot).words
    did = packet.command.did if isinstance(packet, Request) else packet.did
    yield "DID", DEVICE_NAMES[generation].get(did if did is not None else -1, "unknown device")
    yield "CID", _command_name(meaning)
    yield "SEQ", "of the command" if isinstance(packet, Response) else ""
    if isinstance(packet, Response):
        yield "ERR", codec.code_name(packet.code)
    yield from _data(packet.command.payload if isinstance(packet, Request) else packet.payload, meaning)


def _v1_fields(
    packet: Request | Response | Notification, generation: Generation, meaning: Meaning, raw: bytes
) -> Iterator[tuple[str, str]]:
    codec = CODECS[generation]
    yield "SOP1", _START
    match packet:
        case Request(command=command):
            yield "SOP2", ", ".join(codec.flag_names(packet) or ()) or "no options"
            yield "DID", DEVICE_NAMES[generation].get(command.did, "unknown device")
            yield "CID", _command_name(meaning)
            yield "SEQ", ""
            yield "DLEN", f"{raw[5]}: data and checksum"
            yield from _data(command.payload, meaning)
        case Response(code=code, payload=payload):
            yield "SOP2", "response"
            yield "MRSP", codec.code_name(code)
            yield "SEQ", "of the command"
            yield "DLEN", f"{raw[4]}: data and checksum"
            yield from _data(payload, meaning)
        case Notification(payload=payload):
            yield "SOP2", "asynchronous"
            yield "ID", _command_name(meaning)
            length = int.from_bytes(raw[3:5], "big")
            yield "DLEN_hi", f"{length}: data and checksum"
            yield "DLEN_lo", ""
            yield from _data(payload, meaning)


def _command_name(meaning: Meaning) -> str:
    return meaning.row.name if meaning.row else "in no catalogue"


def _data(payload: bytes, meaning: Meaning) -> Iterator[tuple[str, str]]:
    """Yield the data bytes, what they mean together beside the first."""
    decoded = meaning.decoded
    words = ", ".join(
        f"{name} {value}" + (f" {decoded.units[name]}" if decoded and name in decoded.units else "")
        for name, value in (decoded.fields if decoded else {}).items()
    )
    if decoded and decoded.problem:
        words = "; ".join(filter(None, (words, decoded.problem)))
    for at in range(len(payload)):
        yield f"DATA[{at}]", "" if at else words
