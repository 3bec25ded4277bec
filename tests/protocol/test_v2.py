"""The V2 codec, compared with frames of real robots and a simple decoder, also on damaged streams."""

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sphero_probe.protocol import CODECS, v2_decoder, v2_frames
from sphero_probe.protocol.packets import (
    USUAL,
    Command,
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Role,
    Verdict,
)
from sphero_probe.protocol.v2 import MAX_PAYLOAD, V2, V2Codec
from sphero_probe.protocol.v2_frames import MAX_FRAME
from tests.support.narrowing import every, known, only
from tests.support.pieces import ValidPacket, byte_by_byte, decoded, pieces_of, valid_packets
from tests.support.reference_decoder import Frame, frames_in

FILE = Path(__file__).parents[1] / "data" / "golden_frames.json"
GOLDEN = [row for row in json.loads(FILE.read_text(encoding="utf-8")) if row["protocol"] == "v2"]
REAL = [row for row in GOLDEN if row["provenance"] == "real"]
EACH_GOLDEN = pytest.mark.parametrize("row", [pytest.param(row, id=row["id"]) for row in GOLDEN])
EACH_REAL = pytest.mark.parametrize("row", [pytest.param(row, id=row["id"]) for row in REAL])
EACH_ROLE = pytest.mark.parametrize("role", [pytest.param(role, id=role.value) for role in Role])

SPECIAL = (0x8D, 0xAB, 0xD8)
BATTERY = "8d09131007005f6dd8"
WAKE_OK = "8d09130d0000d6d8"

CODES = [
    (0x00, "success", Verdict.OK),
    (0x01, "bad device id", Verdict.NO_DEVICE),
    (0x02, "bad command id", Verdict.NO_COMMAND),
    (0x03, "not yet implemented", Verdict.NOT_IMPLEMENTED),
    (0x04, "restricted", Verdict.RESTRICTED),
    (0x05, "bad data length", Verdict.BAD_LENGTH),
    (0x06, "command failed", Verdict.FAILED),
    (0x07, "bad parameter value", Verdict.BAD_VALUE),
    (0x08, "busy", Verdict.BUSY),
    (0x09, "bad target id", Verdict.NO_TARGET),
    (0x0A, "target unavailable", Verdict.TARGET_UNAVAILABLE),
]


heard = partial(decoded, V2)


def wire(body: Iterable[int]) -> bytes:
    """A frame built without the codec, from its unescaped bytes without the checksum."""
    plain = [*body]
    checksum = 0xFF - sum(plain) % 256
    escaped = [[0xAB, byte & ~0x88] if byte in SPECIAL else [byte] for byte in [*plain, checksum]]
    return bytes([0x8D, *(byte for pair in escaped for byte in pair), 0xD8])


def frame_view(packet: ValidPacket) -> Frame:
    """A packet's contents in the order of the wire."""
    code: int | None = None
    match packet:
        case Request(command=(did, cid, payload, target, _), seq=seq, source=source, flags=flags):
            pass
        case Response(seq, code, payload, did, cid, source, target, flags):
            pass
        case Notification(did, cid, payload, source, target, seq, flags):
            pass
    extension = flags >> 8 if flags & 0x80 else None
    return Frame(flags & 0xFF, extension, target, source, known(did), known(cid), known(seq), code, payload)


def golden_packet(row: dict[str, Any]) -> Packet:
    data = bytes.fromhex(row["data"])
    flags, tid, sid = row["flags"], row["tid"], row["sid"]
    if row["direction"] == "tx":
        wants_answer = flags & 0x06 == 0x02
        return Request(Command(row["did"], row["cid"], data, tid), row["seq"], sid, flags, wants_answer)
    if row["err"] is None:
        return Notification(row["did"], row["cid"], data, sid, tid, row["seq"], flags)
    return Response(row["seq"], row["err"], data, row["did"], row["cid"], sid, tid, flags)


def golden_role(row: dict[str, Any]) -> Role:
    return Role.ROBOT if row["direction"] == "tx" else Role.HOST


def test_codecs_holds_the_codec() -> None:
    assert CODECS[Generation.V2] is V2
    assert V2.generation is Generation.V2
    assert V2.sequence_numbers == range(255)
    assert V2.max_payload == MAX_PAYLOAD


def test_the_golden_frames_are_all_there() -> None:
    assert len(REAL) == 21
    assert len(GOLDEN) == 41
    assert {row["robot"] for row in REAL} == {"RVR", "BOLT", "R2-D2"}


@EACH_GOLDEN
def test_golden_frame_decodes_to_what_it_says(row: dict[str, Any]) -> None:
    frame = bytes.fromhex(row["hex"])
    assert heard([frame], golden_role(row)) == [golden_packet(row)]
    assert heard([frame], Role.OBSERVER) == [golden_packet(row)]


@EACH_GOLDEN
def test_golden_frame_is_rebuilt_to_the_byte(row: dict[str, Any]) -> None:
    assert V2.frame_of(golden_packet(row)).hex() == row["hex"]


@EACH_REAL
def test_golden_frame_cut_anywhere(row: dict[str, Any]) -> None:
    frame, role = bytes.fromhex(row["hex"]), golden_role(row)
    for at in range(len(frame) + 1):
        assert heard([frame[:at], frame[at:]], role) == [golden_packet(row)]
    assert heard(byte_by_byte(frame), role) == [golden_packet(row)]


@pytest.mark.parametrize(
    ("before", "between", "after"),
    [
        pytest.param("00", "00", "00", id="line noise"),
        pytest.param("8d", "8d", "8d", id="stray starts"),
        pytest.param("d8", "d8", "d8", id="stray ends"),
        pytest.param("ab", "ab", "ab", id="stray escapes"),
        pytest.param("8dd8", "d88d", "8dab", id="empty frames"),
        pytest.param("8dab", "ab8dab", "abd8", id="escapes next to markers"),
        pytest.param("8d3921", "8d392101130d", "8d0a", id="frames that break off"),
        pytest.param("8d392101130d0184d8", "8d0901d8", "8d09130d0000d7d8", id="damaged frames"),
        pytest.param("753e", "75 3e 0d 0a", "3e", id="a prompt"),
        pytest.param("ab05ab23ab50", "ab05ab23ab50", "ab05ab23ab50", id="escapes outside frames"),
    ],
)
@EACH_REAL
def test_golden_frame_amid_noise(row: dict[str, Any], before: str, between: str, after: str) -> None:
    frame, role = bytes.fromhex(row["hex"]), golden_role(row)
    stream = bytes.fromhex(before) + frame + bytes.fromhex(between) + frame + bytes.fromhex(after)
    for pieces in ([stream], byte_by_byte(stream)):
        packets = heard(pieces, role)
        assert valid_packets(packets) == [golden_packet(row)] * 2
        assert b"".join(V2.frame_of(packet) for packet in packets) == stream


@EACH_REAL
def test_golden_frame_amid_random_noise(row: dict[str, Any]) -> None:
    frame, role = bytes.fromhex(row["hex"]), golden_role(row)
    random = Random(row["id"])

    def noise() -> bytes:
        return bytes(random.choice((*SPECIAL, random.randrange(256))) for _ in range(random.randrange(12)))

    for _ in range(50):
        stream = noise() + frame + noise() + frame + noise()
        packets = heard([stream], role)
        assert packets.count(golden_packet(row)) == 2
        assert b"".join(V2.frame_of(packet) for packet in packets) == stream


@pytest.mark.parametrize(
    ("code", "name", "verdict"), [pytest.param(*row, id=f"0x{row[0]:02x} {row[1]}") for row in CODES]
)
def test_error_codes(code: int, name: str, verdict: Verdict) -> None:
    response = only(Response, heard([wire([0x09, 0x11, 0x00, 0x05, code])]))
    assert response.code == code
    assert (V2.code_name(response.code), V2.verdict(response.code)) == (name, verdict)


def test_unlisted_codes_are_kept() -> None:
    for code in range(0x0B, 0x100):
        (response,) = heard([wire([0x09, 0x11, 0x00, 0x05, code])])
        assert response == Response(5, code, b"", 0x11, 0x00, None, None, 0x09)
        assert (V2.code_name(code), V2.verdict(code)) == ("unlisted", Verdict.UNLISTED)


POSITIONS = ["flags", "extension", "tid", "sid", "did", "cid", "seq", "err", "data", "checksum"]


@pytest.mark.parametrize("special", [pytest.param(byte, id=f"{byte:02x}") for byte in SPECIAL])
@pytest.mark.parametrize("position", POSITIONS)
def test_escaping_in_every_position(position: str, special: int) -> None:
    values = {
        "flags": 0xB9,
        "extension": 1,
        "tid": 2,
        "sid": 3,
        "did": 4,
        "cid": 5,
        "seq": 6,
        "err": 7,
        "data": 8,
    }
    if position == "checksum":
        others = sum(values.values()) - values["data"]
        values["data"] = (0xFF - special - others) % 256
    else:
        values[position] = special
    if not values["flags"] & 0x10:
        del values["tid"]
    if not values["flags"] & 0x20:
        del values["sid"]
    if not values["flags"] & 0x01:
        del values["err"]
    frame = wire(list(values.values()))
    assert bytes([0xAB, special & ~0x88]) in frame[1:-1]
    assert special not in frame[1:-1] or special == 0xAB
    (packet,) = valid_packets(heard([frame]))
    said: dict[str, Any] = {"tid": None, "sid": None, "err": None, **values}
    assert frame_view(packet) == Frame(**said | {"data": bytes([values["data"]])})
    assert V2.frame_of(packet) == frame
    assert heard(byte_by_byte(frame)) == [packet]


def test_a_real_escaped_checksum() -> None:
    (response,) = heard([bytes.fromhex("8d091a0e4100ab05d8")])
    assert response == Response(0x41, 0x00, b"", 0x1A, 0x0E, None, None, 0x09)
    assert V2.frame_of(response).hex() == "8d091a0e4100ab05d8"


@pytest.mark.parametrize(
    ("frame", "role", "packet"),
    [
        pytest.param("8d0a131007cbd8", Role.ROBOT, Request(Command(0x13, 0x10), 7, None, 0x0A), id="command"),
        pytest.param(
            "8d1a12131007a9d8",
            Role.ROBOT,
            Request(Command(0x13, 0x10, b"", 0x12), 7, None, 0x1A),
            id="command TID",
        ),
        pytest.param(
            "8d2a01131007aad8", Role.ROBOT, Request(Command(0x13, 0x10), 7, 1, 0x2A), id="command SID"
        ),
        pytest.param(
            "8d3a120113100788d8",
            Role.ROBOT,
            Request(Command(0x13, 0x10, b"", 0x12), 7, 1, 0x3A),
            id="command both",
        ),
        pytest.param(
            "8d09131007005f6dd8",
            Role.HOST,
            Response(7, 0, b"\x5f", 0x13, 0x10, None, None, 0x09),
            id="response",
        ),
        pytest.param(
            "8d1921131007005f3cd8",
            Role.HOST,
            Response(7, 0, b"\x5f", 0x13, 0x10, None, 0x21, 0x19),
            id="response TID",
        ),
        pytest.param(
            "8d2902131007005f4bd8",
            Role.HOST,
            Response(7, 0, b"\x5f", 0x13, 0x10, 2, None, 0x29),
            id="response SID",
        ),
        pytest.param(
            "8d392102131007005f1ad8",
            Role.HOST,
            Response(7, 0, b"\x5f", 0x13, 0x10, 2, 0x21, 0x39),
            id="response both",
        ),
        pytest.param(
            "8d081311ffd4d8", Role.HOST, Notification(0x13, 0x11, b"", None, None, 0xFF, 0x08), id="notify"
        ),
        pytest.param(
            "8d18211311ffa3d8",
            Role.HOST,
            Notification(0x13, 0x11, b"", None, 0x21, 0xFF, 0x18),
            id="notify TID",
        ),
        pytest.param(
            "8d28011311ffb3d8", Role.HOST, Notification(0x13, 0x11, b"", 1, None, 0xFF, 0x28), id="notify SID"
        ),
        pytest.param(
            "8d3821011311ff82d8",
            Role.HOST,
            Notification(0x13, 0x11, b"", 1, 0x21, 0xFF, 0x38),
            id="notify both",
        ),
    ],
)
def test_target_and_source_are_independent(frame: str, role: Role, packet: Packet) -> None:
    assert heard([bytes.fromhex(frame)], role) == [packet]
    assert V2.frame_of(packet).hex() == frame


@pytest.mark.parametrize(
    ("body", "role", "said"),
    [
        pytest.param(
            "89 00 10 01 00 00 01 00",
            Role.HOST,
            Frame(0x89, 0, None, None, 0x10, 1, 0, 0, b"\x01\x00"),
            id="zero",
        ),
        pytest.param(
            "b9 7f 21 01 10 01 05 00",
            Role.HOST,
            Frame(0xB9, 0x7F, 0x21, 1, 0x10, 1, 5, 0, b""),
            id="both addresses",
        ),
        pytest.param(
            "8a ff 10 00 07 aa",
            Role.ROBOT,
            Frame(0x8A, 0xFF, None, None, 0x10, 0, 7, None, b"\xaa"),
            id="command",
        ),
        pytest.param(
            "88 01 13 11 ff",
            Role.HOST,
            Frame(0x88, 1, None, None, 0x13, 0x11, 0xFF, None, b""),
            id="notification",
        ),
        pytest.param(
            "89 80 00 10 01 00 02",
            Role.HOST,
            Frame(0x89, 0x80, None, None, 0, 0x10, 1, 0, b"\x02"),
            id="no third byte",
        ),
        pytest.param(
            "88 31 13 11 ff",
            Role.HOST,
            Frame(0x88, 0x31, None, None, 0x13, 0x11, 0xFF, None, b""),
            id="own bits only",
        ),
    ],
)
def test_one_more_flags_byte(body: str, role: Role, said: Frame) -> None:
    frame = wire(bytes.fromhex(body))
    (packet,) = valid_packets(heard([frame], role))
    assert frame_view(packet) == said
    assert V2.frame_of(packet) == frame


def test_every_flags_byte_is_kept() -> None:
    for flags in range(256):
        frame = wire([flags, 1, 2, 3, 4, 5, 6, 7, 8, 9])
        for role in Role:
            (packet,) = valid_packets(heard([frame], role))
            assert packet.flags & 0xFF == flags
            assert isinstance(packet, Response) == bool(flags & 0x01)
            assert V2.frame_of(packet) == frame


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        pytest.param("8d09130d0000d7d8", "checksum 0xd7, expected 0xd6", id="checksum"),
        pytest.param("8d09130d0100d6d8", "checksum 0xd6, expected 0xd5", id="flipped byte"),
        pytest.param("8d091a0e4100ab23d8", "checksum 0xab, expected 0x8d", id="escaped checksum"),
        pytest.param("8d0913ab060000d6d8", "illegal escape ab 06", id="escape of 06"),
        pytest.param("8d0913ab000000d6d8", "illegal escape ab 00", id="escape of 00"),
        pytest.param("8d0913abff0000d6d8", "illegal escape ab ff", id="escape of ff"),
        pytest.param("8d0913abab0500d6d8", "illegal escape ab ab", id="escape of an escape"),
        pytest.param("8dab05ab23ab50ab51d8", "illegal escape ab 51", id="only the last escape"),
        pytest.param("8d09130d0000abd8", "escape ab at the end", id="escape before the end"),
        pytest.param("8dd8", "empty frame", id="empty"),
        pytest.param("8dffd8", "too short", id="checksum only"),
        pytest.param("8d09f6d8", "too short", id="flags only"),
        pytest.param("8d0a130dd5d8", "too short", id="command without SEQ"),
        pytest.param("8d09130d00d6d8", "too short", id="response without ERR"),
        pytest.param("8d29130d0000b6d8", "too short", id="flags want an address"),
        pytest.param("8d8900130d0056d8", "too short", id="flags want another flags byte"),
        pytest.param("8d00d8", "checksum", id="one wrong byte"),
        pytest.param("d8", "outside a frame", id="end outside a frame"),
        pytest.param("00d8", "outside a frame", id="noise and an end"),
        pytest.param("09130d0000d6d8", "outside a frame", id="start lost"),
    ],
)
@EACH_ROLE
def test_malformed(frame: str, reason: str, role: Role) -> None:
    raw = bytes.fromhex(frame)
    for pieces in ([raw], byte_by_byte(raw), [raw[:3], raw[3:]]):
        (packet,) = heard(pieces, role)
        assert isinstance(packet, Malformed)
        assert packet.raw == raw
        assert reason in packet.reason
    assert V2.frame_of(packet) == raw


def test_only_three_escapes_are_legal() -> None:
    for follower in range(256):
        frame = bytes([0x8D, 0x09, 0x13, 0x0D, 0x00, 0x00, 0xAB, follower, 0xD8])
        packets = heard([frame])
        legal = {0x05: 0x8D, 0x23: 0xAB, 0x50: 0xD8}
        if follower in legal:
            assert isinstance(packets[0], Malformed)
            assert "checksum" in packets[0].reason
            assert f"0x{legal[follower]:02x}, expected 0xd6" in packets[0].reason
        elif follower not in (0x8D, 0xD8):
            assert isinstance(packets[0], Malformed)
            assert f"ab {follower:02x}" in packets[0].reason
        assert valid_packets(packets) == []
        assert b"".join(V2.frame_of(packet) for packet in packets) == frame


@pytest.mark.parametrize(
    ("stream", "outcome"),
    [
        pytest.param(
            "8d09130d" + BATTERY, [("unfinished", "8d09130d"), ("", BATTERY)], id="start inside a frame"
        ),
        pytest.param("8d" + BATTERY, [("unfinished", "8d"), ("", BATTERY)], id="two starts"),
        pytest.param(
            "8d8d09" + BATTERY,
            [("unfinished", "8d"), ("unfinished", "8d09"), ("", BATTERY)],
            id="three starts",
        ),
        pytest.param(
            "8d09ab" + BATTERY, [("unfinished", "8d09ab"), ("", BATTERY)], id="start after an escape"
        ),
        pytest.param("00" + BATTERY, [("outside", "00"), ("", BATTERY)], id="noise first"),
        pytest.param(
            "00ab8d09" + BATTERY,
            [("outside", "00ab"), ("unfinished", "8d09"), ("", BATTERY)],
            id="noise, then an unfinished frame",
        ),
        pytest.param(
            BATTERY + "d8" + WAKE_OK, [("", BATTERY), ("outside", "d8"), ("", WAKE_OK)], id="second end"
        ),
        pytest.param(
            BATTERY + "0000d8" + WAKE_OK,
            [("", BATTERY), ("outside", "0000d8"), ("", WAKE_OK)],
            id="noise with an end",
        ),
        pytest.param(
            "8d09130d0000d7d8" + BATTERY,
            [("checksum", "8d09130d0000d7d8"), ("", BATTERY)],
            id="damaged frame first",
        ),
        pytest.param(
            "8d0913ab060000d6d8" + BATTERY,
            [("illegal escape", "8d0913ab060000d6d8"), ("", BATTERY)],
            id="illegal escape first",
        ),
        pytest.param(
            BATTERY + WAKE_OK + BATTERY, [("", BATTERY), ("", WAKE_OK), ("", BATTERY)], id="back to back"
        ),
        pytest.param(
            BATTERY + "8d09130d",
            [("", BATTERY), ("quiet inside a frame", "8d09130d")],
            id="half a frame last",
        ),
        pytest.param(BATTERY + "00ab", [("", BATTERY), ("outside", "00ab")], id="noise last"),
    ],
)
def test_resynchronisation(stream: str, outcome: list[tuple[str, str]]) -> None:
    raw = bytes.fromhex(stream)
    for pieces in ([raw], byte_by_byte(raw)):
        packets = heard(pieces)
        assert [V2.frame_of(packet).hex() for packet in packets] == [part for _, part in outcome]
        for packet, (reason, _) in zip(packets, outcome, strict=True):
            assert isinstance(packet, Malformed) == bool(reason)
            assert not isinstance(packet, Malformed) or reason in packet.reason


LONGEST = b"\x8d" + bytes(MAX_FRAME - 1)
"""A frame as long as a decoder's buffer."""


@pytest.mark.parametrize(
    ("stream", "outcome"),
    [
        pytest.param(LONGEST + b"\xd8", [("checksum", MAX_FRAME + 1)], id="the longest"),
        pytest.param(
            LONGEST + b"\x00\xd8",
            [("no end of frame within", MAX_FRAME), ("outside", 2)],
            id="one byte too long",
        ),
        pytest.param(
            LONGEST + bytes(MAX_FRAME) + b"\x01\xd8",
            [("no end of frame within", MAX_FRAME), ("outside", MAX_FRAME), ("outside", 2)],
            id="far too long",
        ),
        pytest.param(
            bytes(MAX_FRAME) + b"\x00\xd8", [("outside", MAX_FRAME), ("outside", 2)], id="noise with an end"
        ),
        pytest.param(
            LONGEST + b"\x00\x8d\xd8",
            [("no end of frame within", MAX_FRAME), ("outside", 1), ("empty", 2)],
            id="then one",
        ),
        pytest.param(LONGEST + b"\x8d\xd8", [("", MAX_FRAME), ("empty", 2)], id="the longest, unfinished"),
    ],
)
@pytest.mark.parametrize("size", [1, 7, 4095, 4096, 4097, 100_000])
def test_overlong(stream: bytes, outcome: list[tuple[str, int]], size: int) -> None:
    packets = every(Malformed, heard([stream[at : at + size] for at in range(0, len(stream), size)]))
    assert [len(packet.raw) for packet in packets] == [length for _, length in outcome]
    assert all(reason in packet.reason for packet, (reason, _) in zip(packets, outcome, strict=True))
    assert b"".join(packet.raw for packet in packets) == stream


@pytest.mark.parametrize("size", [1, 100, 5000])
@pytest.mark.parametrize(
    "pattern",
    [
        pytest.param(b"\x00", id="zeros"),
        pytest.param(b"\x8d", id="starts"),
        pytest.param(b"\xab", id="escapes"),
        pytest.param(b"\x8d\x09\x13", id="frames that break off"),
        pytest.param(b"\x8d" + bytes(4200), id="overlong frames"),
        pytest.param(b"\x8d" + bytes(1500), id="long frames that break off"),
    ],
)
def test_the_buffer_is_bounded(pattern: bytes, size: int) -> None:
    total = 3 * MAX_FRAME
    stream = (pattern * total)[:total]
    decoder = V2.decoder(Role.HOST)
    reported = 0
    for at in range(0, total, size):
        reported += sum(len(packet.raw) for packet in every(Malformed, decoder.feed(stream[at : at + size])))
        assert min(at + size, total) - reported <= MAX_FRAME
    reported += sum(len(packet.raw) for packet in every(Malformed, decoder.give_up()))
    assert reported == total
    assert decoder.feed(bytes.fromhex(BATTERY)) == heard([bytes.fromhex(BATTERY)])


@pytest.mark.parametrize(
    ("held", "reason"),
    [
        pytest.param("8d", "inside a frame", id="a start"),
        pytest.param("8d09130d0000d6", "inside a frame", id="all but the end"),
        pytest.param("8d0913ab", "inside a frame", id="half an escape"),
        pytest.param("00", "outside a frame", id="noise"),
    ],
)
def test_giving_up_an_unfinished_frame(held: str, reason: str) -> None:
    decoder = V2.decoder(Role.HOST)
    assert decoder.give_up() == []
    assert decoder.feed(bytes.fromhex(held)) == []
    half = only(Malformed, decoder.give_up())
    assert half.raw.hex() == held
    assert reason in half.reason
    assert decoder.give_up() == []
    assert decoder.feed(bytes.fromhex(BATTERY)) == [Response(7, 0, b"\x5f", 0x13, 0x10, None, None, 0x09)]


@pytest.mark.parametrize(
    ("command", "seq", "more"),
    [
        pytest.param(Command(256, 0), 0, {}, id="DID"),
        pytest.param(Command(-1, 0), 0, {}, id="negative DID"),
        pytest.param(Command(0, 256), 0, {}, id="CID"),
        pytest.param(Command(0, 0), 256, {}, id="SEQ"),
        pytest.param(Command(0, 0), -1, {}, id="negative SEQ"),
        pytest.param(Command(0, 0, b"", 256), 0, {}, id="target"),
        pytest.param(Command(0, 0, b"", -1), 0, {}, id="negative target"),
        pytest.param(Command(0, 0), 0, {"source": 256}, id="source"),
        pytest.param(Command(0, 0), 0, {"extension": b"\x00\x00"}, id="extension"),
        pytest.param(Command(0, 0, bytes(MAX_PAYLOAD + 1)), 0, {}, id="payload"),
    ],
)
def test_commands_that_cannot_be_encoded(command: Command, seq: int, more: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"range\(0, 256\)|at most"):
        V2.encode_command(command, seq, **more)


@pytest.mark.parametrize(
    "packet",
    [
        pytest.param(Response(0, 0), id="response without ids"),
        pytest.param(Response(0, 0, b"", 0x13), id="response without CID"),
        pytest.param(Response(0, 0, b"", None, 0x10), id="response without DID"),
        pytest.param(Response(256, 0, b"", 0x13, 0x10), id="response SEQ"),
        pytest.param(Response(0, 256, b"", 0x13, 0x10), id="response code"),
        pytest.param(Response(0, 0, b"", 0x13, 0x10, 256), id="response source"),
        pytest.param(Response(0, 0, bytes(MAX_FRAME + 1), 0x13, 0x10), id="response payload"),
        pytest.param(Notification(None, 0x10), id="notification without DID"),
        pytest.param(Notification(0x13, 0x100), id="notification CID"),
        pytest.param(Notification(0x13, 0x10, seq=256), id="notification SEQ"),
        pytest.param(Notification(0x13, 0x10, bytes(MAX_FRAME + 1)), id="notification payload"),
        pytest.param(Request(Command(0x100, 0), 0), id="request DID"),
    ],
)
def test_packets_that_cannot_be_encoded(packet: Packet) -> None:
    with pytest.raises(ValueError, match=r"range\(0, 256\)|at most|needed"):
        V2.frame_of(packet)


def test_the_longest_payload() -> None:
    for byte in (0x00, 0x8D):
        command = Command(0x10, 0x00, bytes([byte]) * MAX_PAYLOAD)
        request = only(Request, heard([V2Codec().encode_command(command, 3, source=0x01)], Role.ROBOT))
        assert request.command == command


@pytest.mark.parametrize(
    ("command", "seq", "frame"),
    [
        pytest.param(
            Command(0x1A, 0x1C, bytes.fromhex("3fff0000ff0000"), 0x11),
            0,
            "8d 3a 11 01 1a 1c 00 3f ff 00 00 ff 00 00 40 d8",
            id="front and back red",
        ),
        pytest.param(
            Command(0x1A, 0x1C, bytes.fromhex("3f00ff000000ff"), 0x11),
            1,
            "8d 3a 11 01 1a 1c 01 3f 00 ff 00 00 00 ff 3f d8",
            id="front green, back blue",
        ),
        pytest.param(
            Command(0x1A, 0x2F, bytes.fromhex("ff0000"), 0x12),
            2,
            "8d 3a 12 01 1a 2f 02 ff 00 00 68 d8",
            id="matrix",
        ),
        pytest.param(Command(0x13, 0x0D, b"", 0x11), 0, "8d 3a 11 01 13 0d 00 93 d8", id="wake"),
        pytest.param(Command(0x13, 0x10, b"", 0x11), 7, "8d 3a 11 01 13 10 07 89 d8", id="battery"),
        pytest.param(Command(0x13, 0x10), 7, "8d 0a 13 10 07 cb d8", id="battery, no addresses"),
        pytest.param(Command(0x11, 0x00, b"", 0x12), 0, "8d 3a 12 01 11 00 00 a1 d8", id="version of node 2"),
        pytest.param(Command(0x11, 0x03, b"", 0x11), 3, "8d 3a 11 01 11 03 03 9c d8", id="board revision"),
        pytest.param(
            Command(0x16, 0x07, bytes.fromhex("40010e00"), 0x11),
            4,
            "8d 3a 11 01 16 07 04 40 01 0e 00 43 d8",
            id="drive with heading",
        ),
    ],
)
def test_the_bolt_plus_reference(command: Command, seq: int, frame: str) -> None:
    raw = bytes.fromhex(frame)
    assert V2.encode_command(command, seq) == raw
    request = only(Request, heard([raw], Role.ROBOT))
    assert (request.command, request.seq, request.wants_answer) == (command, seq, True)


@pytest.mark.parametrize(
    ("options", "flags", "wants_answer"),
    [
        pytest.param({}, 0x0A, True, id="answer and activity"),
        pytest.param({"activity": False}, 0x02, True, id="answer"),
        pytest.param({"answer": False}, 0x08, False, id="activity"),
        pytest.param({"answer": False, "activity": False}, 0x00, False, id="nothing"),
        pytest.param({"only_errors": True}, 0x0E, False, id="only errors"),
        pytest.param({"only_errors": True, "answer": False}, 0x0C, False, id="only errors, invalid"),
        pytest.param({"source": 0x01}, 0x2A, True, id="source"),
        pytest.param({"extension": b"\x05"}, 0x058A, True, id="extension"),
    ],
)
def test_flags_of_a_command(options: dict[str, Any], flags: int, wants_answer: bool) -> None:
    request = only(Request, heard([V2.encode_command(Command(0x13, 0x10), 7, **options)], Role.ROBOT))
    assert (request.flags, request.wants_answer) == (flags, wants_answer)


@pytest.mark.parametrize(
    ("frame", "host", "robot", "observer"),
    [
        pytest.param("8d09130d0000d6d8", Response, Response, Response, id="response"),
        pytest.param(
            "8d21011106ff0064656339353461656430663603d8", Response, Response, Response, id="response SEQ FF"
        ),
        pytest.param("8d0a131007cbd8", Notification, Request, Request, id="command"),
        pytest.param("8d081311ffd4d8", Notification, Request, Notification, id="notification"),
        pytest.param("8d0a1310ffd3d8", Notification, Request, Request, id="command SEQ FF"),
        pytest.param("8d08131107ccd8", Notification, Request, Request, id="no answer, SEQ 07"),
    ],
)
def test_kinds_by_role(frame: str, host: type[Packet], robot: type[Packet], observer: type[Packet]) -> None:
    raw = bytes.fromhex(frame)
    for role, kind in ((Role.HOST, host), (Role.ROBOT, robot), (Role.OBSERVER, observer)):
        (packet,) = heard([raw], role)
        assert type(packet) is kind
        assert V2.frame_of(packet) == raw


BYTES = st.integers(0, 255) | st.sampled_from((*SPECIAL, 0x05, 0x23, 0x50, 0xFF))
ADDRESSES = st.none() | BYTES
PAYLOADS = st.lists(BYTES, max_size=40).map(bytes)
COMMANDS = st.builds(Command, BYTES, BYTES, PAYLOADS, ADDRESSES, st.just(USUAL))
EXTENSIONS = st.just(b"") | BYTES.map(lambda byte: bytes([byte]))
FLAGS = st.integers(0, 0xFFFF)
RESPONSES = st.builds(Response, BYTES, BYTES, PAYLOADS, BYTES, BYTES, ADDRESSES, ADDRESSES, FLAGS)
NOTIFICATIONS = st.builds(
    Notification, BYTES, BYTES, PAYLOADS, ADDRESSES, ADDRESSES, st.none() | BYTES, FLAGS
)


def expected_flags(packet: Response | Notification, first: int) -> int:
    """The flags that a decoder reports for a packet that was made with any 16 flag bits."""
    flags = packet.flags & 0xFF & ~0x31 | first
    flags |= 0x10 if packet.target is not None else 0
    flags |= 0x20 if packet.source is not None else 0
    return flags | (packet.flags & 0xFF00 if flags & 0x80 else 0)


@given(COMMANDS, BYTES, st.booleans(), st.booleans(), st.booleans(), ADDRESSES, EXTENSIONS)
def test_a_command_round_trips(
    command: Command,
    seq: int,
    answer: bool,
    activity: bool,
    only_errors: bool,
    source: int | None,
    extension: bytes,
) -> None:
    frame = V2Codec().encode_command(
        command,
        seq,
        answer=answer,
        activity=activity,
        only_errors=only_errors,
        source=source,
        extension=extension,
    )
    request = only(Request, heard([frame], Role.ROBOT))
    if source is None and command.target is not None:
        source = 0x01
    assert (request.command, request.seq, request.source) == (command, seq, source)
    assert request.wants_answer == (answer and not only_errors)
    assert [bool(request.flags & bit) for bit in (0x02, 0x04, 0x08)] == [answer, only_errors, activity]
    assert request.flags >> 8 == int.from_bytes(extension)
    assert V2.frame_of(request) == frame
    assert len(frame) >= 7
    (other,) = heard([frame], Role.HOST)
    assert isinstance(other, Notification)
    assert frame_view(other) == frame_view(request)


@given(RESPONSES)
def test_a_response_round_trips(response: Response) -> None:
    frame = V2.encode_response(response)
    expected = response._replace(flags=expected_flags(response, 0x01))
    for role in Role:
        assert heard([frame], role) == [expected]
    assert V2.frame_of(expected) == frame
    assert len(frame) >= 8


@given(NOTIFICATIONS)
def test_a_notification_round_trips(notification: Notification) -> None:
    frame = V2.encode_notification(notification)
    seq = 0xFF if notification.seq is None else notification.seq
    expected = notification._replace(seq=seq, flags=expected_flags(notification, 0x00))
    assert heard([frame]) == [expected]
    assert V2.frame_of(expected) == frame


VALID_FRAMES = (
    st.builds(V2.encode_command, COMMANDS, BYTES, source=ADDRESSES, extension=EXTENSIONS)
    | RESPONSES.map(V2.encode_response)
    | NOTIFICATIONS.map(V2.encode_notification)
)
GARBAGE = st.lists(BYTES, max_size=20).map(bytes)
SMALL = 48
"""The size of a decoder's buffer in the tests of that bound."""
LONG = st.builds(
    lambda start, length: start + bytes(length),
    st.sampled_from((b"", b"\x8d", b"\xab\x8d", b"\xd8\x8d")),
    st.sampled_from((SMALL // 2, SMALL - 2, SMALL - 1, SMALL, SMALL + 1, 2 * SMALL, 2 * SMALL + 1)),
)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A frame in which some bytes were removed or replaced."""
    frame = draw(VALID_FRAMES)
    start = draw(st.integers(0, len(frame) - 1))
    end = draw(st.integers(start, min(start + 4, len(frame))))
    return frame[:start] + draw(st.lists(BYTES, max_size=3).map(bytes)) + frame[end:]


DAMAGE = GARBAGE | damaged()
STREAMS = st.lists(VALID_FRAMES | DAMAGE | LONG, max_size=6).map(b"".join)


@st.composite
def cut_streams(draw: st.DrawFn) -> tuple[bytes, list[bytes]]:
    stream = draw(STREAMS)
    cuts = draw(st.lists(st.integers(0, len(stream)), max_size=12))
    return stream, pieces_of(stream, cuts)


@contextmanager
def holding_back_little() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(v2_frames, "MAX_FRAME", SMALL)
        patch.setattr(v2_decoder, "MAX_FRAME", SMALL)
        patch.setattr(v2_decoder, "ADLER_EXACT", SMALL // 2)  # escaped in full that is SMALL
        for shape in v2_decoder._SHAPES.values():
            shape.clear()
        yield


@given(cut_streams(), st.sampled_from(Role))
def test_any_cut_gives_the_same_packets(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    assert heard(pieces, role) == heard([stream], role) == heard(byte_by_byte(stream), role)


@given(cut_streams(), st.sampled_from(Role))
@example(
    (bytes(47) + b"\x8d" + bytes(20) + b"\x8d\x00", [bytes(47) + b"\x8d" + bytes(20), b"\x8d\x00"]), Role.HOST
)
def test_any_cut_gives_the_same_packets_at_the_bound(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    with holding_back_little():
        assert heard(pieces, role) == heard([stream], role) == heard(byte_by_byte(stream), role)


@given(cut_streams(), st.sampled_from(Role))
def test_every_byte_is_accounted_for(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    assert b"".join(V2.frame_of(packet) for packet in heard(pieces, role)) == stream


@given(st.lists(st.tuples(st.just(True), VALID_FRAMES) | st.tuples(st.just(False), DAMAGE), max_size=8))
def test_every_valid_frame_survives_damage_around_it(parts: list[tuple[bool, bytes]]) -> None:
    stream = b"".join(part for _, part in parts)
    rest = iter([V2.frame_of(packet) for packet in valid_packets(heard([stream]))])
    for intact, part in parts:
        if intact:
            assert part in rest, "a valid frame was lost"


@given(VALID_FRAMES, st.data())
def test_a_flipped_bit_never_goes_unnoticed(frame: bytes, data: st.DataObject) -> None:
    at = data.draw(st.integers(1, len(frame) - 2))
    flipped = bytearray(frame)
    flipped[at] ^= 1 << data.draw(st.integers(0, 7))
    (packet,) = heard([frame])
    assert packet not in heard([bytes(flipped)])


@given(st.lists(st.binary(max_size=60), max_size=6), st.sampled_from(Role))
def test_nothing_on_the_line_raises(pieces: list[bytes], role: Role) -> None:
    packets = heard(pieces, role)
    assert b"".join(V2.frame_of(packet) for packet in packets) == b"".join(pieces)


@given(cut_streams())
def test_at_most_one_frame_is_buffered(cut: tuple[bytes, list[bytes]]) -> None:
    _, pieces = cut
    given_bytes = reported = 0
    with holding_back_little():
        decoder = V2.decoder(Role.HOST)
        for piece in pieces:
            given_bytes += len(piece)
            reported += sum(len(V2.frame_of(packet)) for packet in decoder.feed(piece))
            assert given_bytes - reported <= SMALL


@given(cut_streams(), st.sampled_from(Role))
def test_the_plain_decoder_agrees(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    assert [frame_view(packet) for packet in valid_packets(heard(pieces, role))] == frames_in(
        stream, MAX_FRAME
    )


@given(cut_streams(), st.sampled_from(Role))
def test_the_plain_decoder_agrees_at_the_bound(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    with holding_back_little():
        assert [frame_view(packet) for packet in valid_packets(heard(pieces, role))] == frames_in(
            stream, SMALL
        )


def random_stream(random: Random) -> bytes:
    """Real frames in a row, some damaged, with noise between them."""
    stream = bytearray()
    for _ in range(random.randrange(1, 6)):
        stream += bytes.fromhex(random.choice(GOLDEN)["hex"])
        stream += bytes(
            random.choice((*SPECIAL, 0x05, random.randrange(256))) for _ in range(random.randrange(4))
        )
    for _ in range(random.randrange(6)):
        at = random.randrange(len(stream))
        match random.randrange(4):
            case 0:
                stream[at] = random.choice((*SPECIAL, random.randrange(256)))
            case 1:
                del stream[at : at + random.randrange(1, 4)]
            case 2:
                stream[at:at] = stream[: random.randrange(1, 12)]
            case 3:
                stream[at] ^= 1 << random.randrange(8)
        if not stream:
            break
    return bytes(stream)


@pytest.mark.parametrize("seed", range(10))
def test_the_plain_decoder_agrees_on_damaged_streams(seed: int) -> None:
    random = Random(seed)
    survivors = 0
    for _ in range(400):
        stream = random_stream(random)
        expected = frames_in(stream, MAX_FRAME)
        survivors += len(expected)
        assert [frame_view(packet) for packet in valid_packets(heard([stream]))] == expected
        cuts = [random.randrange(len(stream) + 1) for _ in range(random.randrange(6))]
        assert [frame_view(packet) for packet in valid_packets(heard(pieces_of(stream, cuts)))] == expected
    assert survivors > 400
