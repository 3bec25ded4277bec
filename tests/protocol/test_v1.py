"""The V1 codec, compared with the documents' frames and a simple decoder, also on damaged streams."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from random import Random

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from sphero_probe.catalogue.payload.layout import Layout
from sphero_probe.link.exchange import Answered, LateResponse, Silent
from sphero_probe.link.tracker import QUIET, Tracker
from sphero_probe.protocol import CODECS, v1, v1_frames
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
from sphero_probe.protocol.v1 import FIXED_PAYLOADS, MAX_ASYNC_PAYLOAD, MAX_PAYLOAD, V1
from sphero_probe.protocol.v1_frames import MAX_FRAME
from sphero_probe.protocol.v2 import V2
from tests.support.narrowing import every, only
from tests.support.pieces import ValidPacket, byte_by_byte, decoded, pieces_of, valid_packets
from tests.support.reference_decoder_v1 import ASYNC, COMMAND, RESPONSE, frames_in

FILE = Path(__file__).parents[1] / "data" / "golden_frames.json"
GOLDEN = {row["id"]: row for row in json.loads(FILE.read_text(encoding="utf-8")) if row["protocol"] == "v1"}
EACH_ROLE = pytest.mark.parametrize("role", [pytest.param(role, id=role.value) for role in Role])

PROMPT = b"u>"
PING = "ffff00015201ab"
PONG = "ffff005201ac"
PING_PACKET = Request(Command(0x00, 0x01), 0x52, None, 0xFF)
PONG_PACKET = Response(0x52, 0x00, flags=0xFF)
M1 = Notification(None, 0x03, bytes.fromhex("0001fff8"), flags=0xFE)
M2 = Notification(None, 0x03, bytes.fromhex("0000fffd"), flags=0xFE)

CODES = [
    (0x00, "OK", Verdict.OK),
    (0x01, "general error", Verdict.FAILED),
    (0x02, "bad checksum", Verdict.DAMAGED),
    (0x03, "command fragment", Verdict.DAMAGED),
    (0x04, "unknown command id", Verdict.NO_COMMAND),
    (0x05, "unsupported command", Verdict.NOT_IMPLEMENTED),
    (0x06, "bad message format", Verdict.BAD_LENGTH),
    (0x07, "bad parameter value", Verdict.BAD_VALUE),
    (0x08, "execution failed", Verdict.FAILED),
    (0x09, "unknown device id", Verdict.NO_DEVICE),
    (0x0A, "memory busy", Verdict.BUSY),
    (0x0B, "bad password", Verdict.RESTRICTED),
    (0x31, "power no good", Verdict.FAILED),
    (0x32, "page illegal", Verdict.BAD_VALUE),
    (0x33, "flash fail", Verdict.FAILED),
    (0x34, "main app corrupt", Verdict.FAILED),
    (0x35, "message timeout", Verdict.DAMAGED),
]


heard = partial(decoded, V1)
Content = tuple[str, int, tuple[int, ...], bytes]
"""The kind, SOP2, the ids and the data, as the simple decoder reports them."""


def raw_of(packets: Sequence[Packet]) -> bytes:
    return b"".join(V1.frame_of(packet) for packet in packets)


def wire(start: str) -> bytes:
    """A frame built without the codec, from all its bytes except the checksum, as hex."""
    data = bytes.fromhex(start)
    return data + bytes([0xFF - sum(data[2:]) % 256])


def content_of(packet: ValidPacket) -> Content:
    """A packet's contents as the simple decoder reports them, without the places."""
    match packet:
        case Request(command=(did, cid, payload, None, _), seq=seq, source=None, flags=flags):
            return (COMMAND, flags, (did, cid, seq), payload)
        case Response(seq, code, payload, None, None, None, None, flags):
            return (RESPONSE, flags, (code, seq), payload)
        case Notification(None, cid, payload, None, None, None, flags):
            return (ASYNC, flags, (cid,), payload)
    raise AssertionError(f"V1 has no place for all of {packet!r}")


def contents_in(stream: bytes, role: Role, longest: int = MAX_FRAME) -> list[Content]:
    return [frame[:4] for frame in frames_in(stream, role.value, longest)]


def contents_of(packets: Sequence[Packet]) -> list[Content]:
    return [content_of(packet) for packet in valid_packets(packets)]


def test_codecs_holds_the_codec() -> None:
    assert CODECS[Generation.V1] is V1
    assert V1.generation is Generation.V1
    assert V1.sequence_numbers == range(256)
    assert V1.max_payload == MAX_PAYLOAD == 254


def test_the_golden_frames_are_all_there() -> None:
    assert {key: row["provenance"] for key, row in GOLDEN.items()} == {
        "M1": "real",
        "M2": "real",
        "X2": "constructed",
    }


@pytest.mark.parametrize(
    ("hexed", "role", "packet"),
    [
        pytest.param(PING, Role.ROBOT, PING_PACKET, id="the document's ping"),
        pytest.param(PONG, Role.HOST, PONG_PACKET, id="simple response"),
        pytest.param(GOLDEN["M1"]["hex"], Role.HOST, M1, id="M1"),
        pytest.param(GOLDEN["M2"]["hex"], Role.HOST, M2, id="M2"),
        pytest.param(
            GOLDEN["X2"]["hex"], Role.ROBOT, Request(Command(0x00, 0x01), 0x55, None, 0xFF), id="X2"
        ),
        pytest.param(
            "ffff0230070580005a01e6",
            Role.ROBOT,
            Request(Command(0x02, 0x30, bytes.fromhex("80005a01")), 7, None, 0xFF),
            id="roll",
        ),
        pytest.param(
            "ffff00030501020304ed",
            Role.HOST,
            Response(3, 0, bytes([1, 2, 3, 4]), flags=0xFF),
            id="response with data",
        ),
        pytest.param("ffff040101f9", Role.HOST, Response(1, 4, flags=0xFF), id="unknown command"),
        pytest.param("ffff090101f4", Role.HOST, Response(1, 9, flags=0xFF), id="unknown device"),
        pytest.param(
            "fffe01000202fa", Role.HOST, Notification(None, 1, b"\x02", flags=0xFE), id="power state"
        ),
        pytest.param("fffe050001f9", Role.HOST, Notification(None, 5, flags=0xFE), id="pre-sleep warning"),
        pytest.param("fffe140001ea", Role.HOST, Notification(None, 0x14, flags=0xFE), id="did sleep"),
        pytest.param(
            "fffe0700110d" + "00" * 15 + "da",
            Role.HOST,
            Notification(None, 7, b"\x0d" + bytes(15), flags=0xFE),
            id="collision",
        ),
    ],
)
def test_frames_of_the_documents(hexed: str, role: Role, packet: Packet) -> None:
    raw = bytes.fromhex(hexed)
    for pieces in ([raw], byte_by_byte(raw), *([raw[:at], raw[at:]] for at in range(len(raw)))):
        assert heard(pieces, role) == [packet]
    assert heard([raw], Role.OBSERVER) == [packet]
    assert V1.frame_of(packet) == raw == wire(hexed[:-2])
    for noise in (PROMPT, b"\x00", b"u>\r\nu>"):
        for pieces in ([noise + raw + noise + raw], byte_by_byte(noise + raw + noise + raw)):
            outside = Malformed(noise, "bytes outside a frame")
            assert heard(pieces, role) == [outside, packet, outside, packet]


def test_the_checksum_of_the_documents_ping() -> None:
    assert V1.encode_command(Command(0x00, 0x01), 0x52).hex() == PING
    assert V1.encode_command(Command(0x00, 0x01), 0x55).hex() == GOLDEN["X2"]["hex"]


@pytest.mark.parametrize("row", [pytest.param(GOLDEN[key], id=key) for key in ("M1", "M2")])
def test_a_prompt_comes_first(row: dict[str, str]) -> None:
    frame = bytes.fromhex(row["hex"])
    packet = {"M1": M1, "M2": M2}[row["id"]]
    for role in (Role.HOST, Role.OBSERVER):
        for pieces in ([PROMPT + frame], [PROMPT, frame], byte_by_byte(PROMPT + frame)):
            assert heard(pieces, role) == [Malformed(PROMPT, "bytes outside a frame"), packet]


@pytest.mark.parametrize(
    ("layout", "data", "value"),
    [
        pytest.param("value:u32", "22 78 00 41", 0x22780041, id="unsigned 32 bits"),
        pytest.param("value:f32", "40 49 0f db", 3.1415927, id="single precision"),
    ],
)
def test_numbers_are_packed_with_the_high_byte_first(layout: str, data: str, value: float) -> None:
    payload = bytes.fromhex(data)
    response = only(Response, heard([V1.encode_response(Response(1, 0, payload))]))
    assert Layout(layout).decode(response.payload).fields == {"value": value}
    request = only(
        Request,
        heard(
            [V1.encode_command(Command(0x02, 0x20, Layout(layout).encode({"value": value})), 1)], Role.ROBOT
        ),
    )
    assert request.command.payload == payload


@pytest.mark.parametrize(
    ("code", "name", "verdict"), [pytest.param(*row, id=f"0x{row[0]:02x} {row[1]}") for row in CODES]
)
def test_mrsp_codes(code: int, name: str, verdict: Verdict) -> None:
    (response,) = heard([wire(f"ffff{code:02x}0501")])
    assert response == Response(5, code, flags=0xFF)
    assert (V1.code_name(code), V1.verdict(code)) == (name, verdict)


def test_unlisted_codes_are_kept() -> None:
    listed = {code for code, *_ in CODES}
    for code in set(range(256)) - listed:
        (response,) = heard([wire(f"ffff{code:02x}0501")])
        assert response == Response(5, code, flags=0xFF)
        assert (V1.code_name(code), V1.verdict(code)) == ("unlisted", Verdict.UNLISTED)


def test_the_same_byte_means_something_else_than_in_v2() -> None:
    shared = range(0x01, 0x0B)
    assert [code for code in shared if V1.verdict(code) is V2.verdict(code)] == [0x07]


@pytest.mark.parametrize(
    ("options", "sop2", "wants_answer"),
    [
        pytest.param({}, "ff", True, id="answer and reset timeout"),
        pytest.param({"activity": False}, "fd", True, id="answer"),
        pytest.param({"answer": False}, "fe", False, id="reset timeout"),
        pytest.param({"answer": False, "activity": False}, "fc", False, id="nothing"),
    ],
)
def test_option_bits_of_a_command(options: dict[str, bool], sop2: str, wants_answer: bool) -> None:
    frame = V1.encode_command(Command(0x02, 0x30, bytes.fromhex("80005a01"), 0x12), 7, **options)
    assert frame == wire(f"ff{sop2}0230070580005a01")
    request = only(Request, heard([frame], Role.ROBOT))
    assert (request.flags, request.wants_answer) == (int(sop2, 16), wants_answer)
    assert heard([frame], Role.OBSERVER) == [request]
    assert V1.frame_of(request) == frame


def test_every_second_start_byte() -> None:
    for sop2 in range(256):
        frame = wire(f"ff{sop2:02x}02300701")
        (packet,) = heard([frame], Role.ROBOT)
        if sop2 < 0xF8:
            assert packet == Malformed(frame, "bytes outside a frame")
        else:
            assert packet == Request(Command(0x02, 0x30), 7, None, sop2, sop2 % 2 == 1)
        assert V1.frame_of(packet) == frame


def test_a_session_with_answer_off() -> None:
    commands = [Command(0x02, 0x30, bytes([speed, 0, 90, 1])) for speed in range(20)]
    sent = [V1.encode_command(command, seq, answer=False) for seq, command in enumerate(commands)]
    requests = every(Request, heard(sent, Role.ROBOT))
    assert [(request.command, request.seq) for request in requests] == list(
        zip(commands, range(20), strict=True)
    )
    assert not any(request.wants_answer for request in requests)
    streamed = V1.encode_notification(M1)
    assert heard([streamed] * 20) == [M1] * 20
    tapped = [piece for frame in sent for piece in (frame, streamed)]
    packets = heard([b"".join(tapped)], Role.OBSERVER)
    assert packets == [packet for request in requests for packet in (request, M1)]


@pytest.mark.parametrize(
    ("frame", "host", "robot", "observer"),
    [
        pytest.param(PING, Malformed, Request, Request, id="ping"),
        pytest.param(PONG, Response, Malformed, Response, id="simple response"),
        pytest.param("ffff00fe0100", Response, Malformed, Response, id="response, checksum 00"),
        pytest.param("fffe0300050001fff8ff", Notification, Malformed, Notification, id="async"),
        pytest.param("fffe00010301fa", Malformed, Request, Request, id="ping, no answer"),
        pytest.param("fffc00010301fa", Malformed, Request, Request, id="ping, no option"),
        pytest.param("fffe00000301fb", Malformed, Request, Malformed, id="CID 00, no answer"),
        pytest.param(wire("fffe00000200").hex(), Notification, Malformed, Notification, id="async id 00"),
        pytest.param("ffff00010201fb", Response, Request, Request, id="both fit"),
        pytest.param(wire("fffe0300040201ff").hex(), Notification, Malformed, Notification, id="short async"),
    ],
)
def test_kinds_by_role(frame: str, host: type[Packet], robot: type[Packet], observer: type[Packet]) -> None:
    raw = bytes.fromhex(frame)
    for role, kind in ((Role.HOST, host), (Role.ROBOT, robot), (Role.OBSERVER, observer)):
        packets = heard([raw], role)
        assert type(packets[0]) is kind
        assert raw_of(packets) == raw


def test_an_observer_remembers_unanswered_commands() -> None:
    command = V1.encode_command(Command(0x02, 0x22), 0x01)
    both_fit = bytes.fromhex("ffff00010201fb")
    as_command = Request(Command(0x00, 0x01), 2, None, 0xFF)
    as_response = Response(1, 0, b"\x01", flags=0xFF)
    unanswered = V1.encode_command(Command(0x02, 0x22), 0x01, answer=False)
    assert heard([both_fit], Role.OBSERVER) == [as_command]
    assert heard([command, both_fit], Role.OBSERVER)[1:] == [as_response]
    assert heard([command, both_fit, both_fit], Role.OBSERVER)[1:] == [as_response, as_command]
    assert heard([unanswered, both_fit], Role.OBSERVER)[1:] == [as_command]


def test_an_observer_reads_both_directions_of_a_session() -> None:
    stream, expected = b"", []
    for seq in range(256):
        command = Command(0x02, 0x20 + seq % 3, bytes(range(1, 1 + seq % 5)))
        answer = Response(seq, 0x00 if seq % 7 else 0x04, bytes([1, 0x10])[: seq % 3])
        stream += V1.encode_command(command, seq) + V1.encode_response(answer)
        expected += [Request(command, seq, None, 0xFF), answer._replace(flags=0xFF)]
    assert heard([stream], Role.OBSERVER) == expected


def test_the_longest_plain_payload() -> None:
    payload = bytes(range(254))
    frame = V1.encode_command(Command(0x02, 0x51, payload), 3)
    assert frame[5] == 0xFF
    assert [packet.command.payload for packet in every(Request, heard([frame], Role.ROBOT))] == [payload]
    answer = V1.encode_response(Response(3, 0, payload))
    assert answer[4] == 0xFF
    assert [packet.payload for packet in every(Response, heard(byte_by_byte(answer)))] == [payload]


def test_a_length_of_ff_stands_for_the_soul_block() -> None:
    ((did, cid), length) = next(iter(FIXED_PAYLOADS.items()))
    assert (did, cid, length) == (0x02, 0x47, 0x404)
    payload = bytes(index % 251 for index in range(length))
    frame = V1.encode_command(Command(did, cid, payload), 9)
    assert (frame[5], len(frame)) == (0xFF, 6 + 0x404 + 1)
    for role in (Role.ROBOT, Role.OBSERVER):
        for pieces in ([frame], byte_by_byte(frame)):
            (request,) = heard(pieces, role)
            assert request == Request(Command(did, cid, payload), 9, None, 0xFF)
    assert V1.frame_of(request) == frame
    short = V1.encode_command(Command(did, cid, bytes(253)), 9)
    assert short[5] == 0xFE
    assert only(Request, heard([short], Role.ROBOT)).command.payload == bytes(253)
    answer = V1.encode_response(Response(0x47, 0x02, bytes(254)))
    assert heard([answer]) == [Response(0x47, 0x02, bytes(254), flags=0xFF)]


@pytest.mark.parametrize("length", [0, 1, 254, 255, 256, 0x440, MAX_ASYNC_PAYLOAD])
def test_a_notification_has_a_length_of_16_bits(length: int) -> None:
    payload = bytes(index % 253 for index in range(length))
    frame = V1.encode_notification(Notification(None, 0x0D, payload))
    assert int.from_bytes(frame[3:5]) == length + 1
    for role in (Role.HOST, Role.OBSERVER):
        for pieces in ([frame], byte_by_byte(frame), [frame[:4], frame[4:]]):
            assert heard(pieces, role) == [Notification(None, 0x0D, payload, flags=0xFE)]


@pytest.mark.parametrize(
    ("packet", "reason"),
    [
        pytest.param(Request(Command(256, 0), 0), "range", id="DID"),
        pytest.param(Request(Command(-1, 0), 0), "range", id="negative DID"),
        pytest.param(Request(Command(0, 256), 0), "range", id="CID"),
        pytest.param(Request(Command(0, 0), 256), "range", id="SEQ"),
        pytest.param(Request(Command(0, 0, bytes(255)), 0), "at most 254", id="command payload"),
        pytest.param(
            Request(Command(2, 0x47, bytes(254)), 0), "at most 253 or exactly 1028", id="soul block too short"
        ),
        pytest.param(
            Request(Command(2, 0x47, bytes(1029)), 0), "at most 253 or exactly 1028", id="soul block too long"
        ),
        pytest.param(Response(256, 0), "range", id="response SEQ"),
        pytest.param(Response(0, 256), "range", id="response code"),
        pytest.param(Response(0, 0, bytes(255)), "at most 254", id="response payload"),
        pytest.param(Notification(None, 256), "range", id="async id"),
        pytest.param(Notification(0x02, 0x03), "did is not needed", id="async DID"),
        pytest.param(Notification(None, 3, bytes(MAX_ASYNC_PAYLOAD + 1)), "at most 4090", id="async payload"),
    ],
)
def test_packets_that_cannot_be_encoded(packet: Packet, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        V1.frame_of(packet)
    if isinstance(packet, Request):
        with pytest.raises(ValueError, match=reason):
            V1.encode_command(packet.command, packet.seq)


DAMAGED_PONG = "ffff005201ad"
FALSE_RESPONSE = "ffff0001f0"
FALSE_ASYNC = "fffe030ff0"
HUGE_ASYNC = "fffe03ffff"


@pytest.mark.parametrize(
    ("stream", "outcome"),
    [
        pytest.param(PONG + PONG, [("", PONG), ("", PONG)], id="back to back"),
        pytest.param("753e" + PONG, [("outside", "753e"), ("", PONG)], id="a prompt"),
        pytest.param(PONG + "753e" + PONG + "753e", [("", PONG), ("outside", "753e")] * 2, id="prompts"),
        pytest.param(DAMAGED_PONG, [("checksum 0xad, expected 0xac", DAMAGED_PONG)], id="damaged"),
        pytest.param(
            DAMAGED_PONG + "00" + PONG,
            [("checksum", DAMAGED_PONG), ("outside", "00"), ("", PONG)],
            id="damaged, noise, valid",
        ),
        pytest.param(DAMAGED_PONG + PONG, [("checksum", DAMAGED_PONG), ("", PONG)], id="damaged, valid"),
        pytest.param(DAMAGED_PONG * 2, [("checksum", DAMAGED_PONG)] * 2, id="damaged twice"),
        pytest.param(
            "ffff00530302" + PONG,
            [("checksum", "ffff00530302"), ("", PONG)],
            id="bytes lost, valid frame inside",
        ),
        pytest.param(
            "ffff005303aa" + PONG, [("checksum", "ffff005303aa"), ("", PONG)], id="last byte is a start"
        ),
        pytest.param(
            "ffff000100" + PONG, [("length of 0", "ffff000100"), ("", PONG)], id="no room for a checksum"
        ),
        pytest.param(HUGE_ASYNC + PONG, [("at most 4096", HUGE_ASYNC), ("", PONG)], id="64 kB announced"),
        pytest.param(FALSE_RESPONSE + PONG, [("11 of 245", FALSE_RESPONSE), ("", PONG)], id="false length"),
        pytest.param(FALSE_ASYNC + PONG, [("11 of 4085", FALSE_ASYNC), ("", PONG)], id="false async length"),
        pytest.param(
            FALSE_RESPONSE + PONG + "00" + PONG,
            [("of 245", FALSE_RESPONSE), ("", PONG), ("outside", "00"), ("", PONG)],
            id="false length, two valid",
        ),
        pytest.param(
            FALSE_RESPONSE + FALSE_RESPONSE + PONG,
            [("16 of 245", FALSE_RESPONSE * 2), ("", PONG)],
            id="false length twice",
        ),
        pytest.param(
            FALSE_RESPONSE + DAMAGED_PONG + PONG,
            [("17 of 245", FALSE_RESPONSE + DAMAGED_PONG), ("", PONG)],
            id="false length, damaged, valid",
        ),
        pytest.param(PONG + "ffff00", [("", PONG), ("3 of 6", "ffff00")], id="half a frame last"),
        pytest.param(PONG + "ff", [("", PONG), ("outside", "ff")], id="half a start last"),
        pytest.param(
            PONG + "ff00" + PONG, [("", PONG), ("outside", "ff00"), ("", PONG)], id="half a start between"
        ),
        pytest.param("ff" + PONG, [("7 of 87", "ff"), ("", PONG)], id="stray first byte"),
    ],
)
def test_resynchronisation(stream: str, outcome: list[tuple[str, str]]) -> None:
    raw = bytes.fromhex(stream)
    for pieces in ([raw], byte_by_byte(raw)):
        packets = heard(pieces)
        assert [V1.frame_of(packet).hex() for packet in packets] == [part for _, part in outcome]
        for packet, (reason, _) in zip(packets, outcome, strict=True):
            assert isinstance(packet, Malformed) == bool(reason)
            assert not isinstance(packet, Malformed) or reason in packet.reason


@EACH_ROLE
@pytest.mark.parametrize("cut", [1, 3, 1000])
@pytest.mark.parametrize(
    "start",
    [
        pytest.param("ffff00ffff", id="any frame of 255 bytes"),
        pytest.param("fffe010ff0", id="async of 4080 bytes"),
        pytest.param("ffff0247ffff", id="soul block"),
        pytest.param("ffff00ffffff00ffff", id="twice"),
        pytest.param("ffffffffffffff", id="starts only"),
    ],
)
def test_a_false_length_hides_no_response(start: str, cut: int, role: Role) -> None:
    frame, packet = (
        (bytes.fromhex(PING), PING_PACKET) if role is Role.ROBOT else (bytes.fromhex(PONG), PONG_PACKET)
    )
    decoder = V1.decoder(role)
    stream = bytes.fromhex(start) + frame * 3
    packets = [packet for at in range(0, len(stream), cut) for packet in decoder.feed(stream[at : at + cut])]
    packets += decoder.give_up()
    assert valid_packets(packets) == [packet] * 3
    assert raw_of(packets) == stream
    assert decoder.feed(frame) == [packet]


def test_packets_after_a_false_length_arrive_without_giving_up() -> None:
    decoder = V1.decoder(Role.HOST)
    stream = bytes.fromhex(FALSE_RESPONSE) + bytes.fromhex(PONG) * 39
    assert decoder.feed(stream) == []
    packets = decoder.feed(bytes.fromhex(PONG))
    assert isinstance(packets[0], Malformed)
    assert packets[0].raw == bytes.fromhex(FALSE_RESPONSE)
    assert "checksum" in packets[0].reason
    assert packets[1:] == [PONG_PACKET] * 40


def test_a_start_inside_a_valid_frame_is_data() -> None:
    inner = V1.encode_response(Response(1, 0))
    outer = V1.encode_notification(Notification(None, 0x08, inner * 3))
    assert heard([outer]) == [Notification(None, 0x08, inner * 3, flags=0xFE)]
    assert heard(byte_by_byte(outer)) == heard([outer])


@pytest.mark.parametrize(
    ("held", "reason"),
    [
        pytest.param("ff", "outside a frame", id="half a start"),
        pytest.param("00ff", "outside a frame", id="noise and half a start"),
        pytest.param("753e", "outside a frame", id="a prompt"),
        pytest.param("ffff", "2 of 6 bytes", id="a start"),
        pytest.param("ffff005201", "5 of 6 bytes", id="all but the checksum"),
        pytest.param("fffe03000500", "6 of 10 bytes", id="half an async"),
        pytest.param("ffff00530300ff", "7 of 8 bytes", id="ends with half a start"),
        pytest.param("ffff005302ffff", "checksum 0xff, expected 0xab", id="damaged, ends with half a start"),
    ],
)
def test_giving_up_an_unfinished_frame(held: str, reason: str) -> None:
    decoder = V1.decoder(Role.HOST)
    assert decoder.give_up() == []
    assert decoder.feed(bytes.fromhex(held)) == []
    half = only(Malformed, decoder.give_up())
    assert half.raw.hex() == held
    assert reason in half.reason
    assert decoder.give_up() == []
    assert decoder.feed(b"") == []
    assert decoder.feed(bytes.fromhex(PONG)) == [PONG_PACKET]


LONGEST = b"\xff\xfe\x0d\x0f\xfb" + bytes(MAX_FRAME - 5)
"""A damaged frame of the maximum length."""


@pytest.mark.parametrize(
    ("stream", "outcome"),
    [
        pytest.param(LONGEST, [("checksum", MAX_FRAME)], id="the longest"),
        pytest.param(LONGEST + b"\x00", [("checksum", MAX_FRAME), ("outside", 1)], id="the longest, noise"),
        pytest.param(bytes(MAX_FRAME), [("outside", MAX_FRAME)], id="noise"),
        pytest.param(
            bytes(MAX_FRAME) + b"\xff", [("outside", MAX_FRAME), ("outside", 1)], id="noise, half a start"
        ),
        pytest.param(
            bytes(MAX_FRAME - 1) + b"\xff\xff\x00\x52\x01\xac",
            [("outside", MAX_FRAME - 1), ("", 6)],
            id="noise, valid",
        ),
        pytest.param(
            bytes(2 * MAX_FRAME + 1), [("outside", MAX_FRAME)] * 2 + [("outside", 1)], id="much noise"
        ),
        pytest.param(
            b"\xff\xfe\x0d\x0f\xfc\x00", [("4097 bytes", 5), ("outside", 1)], id="one byte too long"
        ),
        pytest.param(
            b"\xff" * (MAX_FRAME + 2), [("checksum", MAX_FRAME), ("checksum", 2)], id="nothing but starts"
        ),
    ],
)
@pytest.mark.parametrize("size", [1, 7, 4095, 4096, 4097, 100_000])
def test_overlong(stream: bytes, outcome: list[tuple[str, int]], size: int) -> None:
    packets = heard([stream[at : at + size] for at in range(0, len(stream), size)])
    assert [len(V1.frame_of(packet)) for packet in packets] == [length for _, length in outcome]
    for packet, (reason, _) in zip(packets, outcome, strict=True):
        assert isinstance(packet, Malformed) == bool(reason)
        assert not isinstance(packet, Malformed) or reason in packet.reason
    assert raw_of(packets) == stream


@EACH_ROLE
@pytest.mark.parametrize("size", [1, 100, 5000])
@pytest.mark.parametrize(
    "pattern",
    [
        pytest.param(b"\x00", id="zeros"),
        pytest.param(b"\xff", id="starts"),
        pytest.param(b"\xff\xfe\x03\x0f\xf0", id="false async lengths"),
        pytest.param(b"\xff\xff\x00\x00\xff", id="false lengths"),
        pytest.param(b"\xff\xff\x02\x47\x00\xff", id="false soul blocks"),
        pytest.param(bytes(4200) + b"\xff", id="noise and half starts"),
    ],
)
def test_the_buffer_is_bounded(pattern: bytes, size: int, role: Role) -> None:
    total = 3 * MAX_FRAME
    stream = (pattern * total)[:total]
    decoder = V1.decoder(role)
    packets = []
    for at in range(0, total, size):
        packets += decoder.feed(stream[at : at + size])
        told = len(raw_of(packets))
        assert min(at + size, total) - told < 2 * MAX_FRAME
    packets += decoder.give_up()
    assert raw_of(packets) == stream
    frame = V1.encode_command(Command(2, 0x30), 7, answer=False)
    assert decoder.feed(frame) == V1.decoder(role).feed(frame)


def test_a_response_after_a_false_length_is_matched() -> None:
    tracker = Tracker(V1)
    seq, frame = tracker.ask(Command(0x00, 0x01), now=0.0, timeout=1.0)
    assert frame == V1.encode_command(Command(0x00, 0x01), seq)
    other, _ = tracker.ask(Command(0x00, 0x02), now=0.0, timeout=1.0)
    answer = V1.encode_response(Response(seq, 0))
    assert list(tracker.hear(bytes.fromhex(FALSE_ASYNC) + answer, now=0.5)) == []
    assert list(tracker.expire(now=0.5 + QUIET)) == []
    half, answered, silent = tracker.expire(now=1.0)
    assert isinstance(half, Malformed)
    assert half == Malformed(bytes.fromhex(FALSE_ASYNC), half.reason)
    assert isinstance(answered, Answered)
    assert (answered.seq, answered.received, answered.rtt) == (seq, answer, 1.0)
    assert isinstance(silent, Silent)
    assert silent.seq == other
    (late,) = tracker.hear(answer, now=1.0)
    assert isinstance(late, LateResponse)
    assert late.earlier == answered
    assert tracker.next_deadline() is None


BYTES = st.integers(0, 255) | st.sampled_from((0xFF, 0xFE, 0xF8, 0x00, 0x01, 0x02, 0x47))
PAYLOADS = st.lists(BYTES, max_size=30).map(bytes)
COMMANDS = st.builds(Command, BYTES, BYTES, PAYLOADS, st.none(), st.just(USUAL))
RESPONSES = st.tuples(BYTES, BYTES, PAYLOADS).map(lambda fields: Response(*fields, flags=0xFF))
NOTIFICATIONS = st.tuples(BYTES, PAYLOADS).map(lambda fields: Notification(None, *fields, flags=0xFE))
REQUEST_FRAMES = st.builds(V1.encode_command, COMMANDS, BYTES, answer=st.booleans(), activity=st.booleans())
ANSWER_FRAMES = RESPONSES.map(V1.encode_response) | NOTIFICATIONS.map(V1.encode_notification)
FRAMES = {
    Role.ROBOT: REQUEST_FRAMES,
    Role.HOST: ANSWER_FRAMES,
    Role.OBSERVER: REQUEST_FRAMES | ANSWER_FRAMES,
}
GARBAGE = st.lists(BYTES, max_size=20).map(bytes)
FALSE_STARTS = st.sampled_from(
    [
        bytes.fromhex(start)
        for start in ("ffff0001f0", FALSE_ASYNC, HUGE_ASYNC, "ff", "ffff0100", "ffff0247ffff", "fff8")
    ]
)
SMALL = 32
"""The maximum length of a frame in the tests of that bound."""


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A frame in which some bytes were removed or replaced."""
    frame = draw(REQUEST_FRAMES | ANSWER_FRAMES)
    start = draw(st.integers(0, len(frame) - 1))
    end = draw(st.integers(start, min(start + 4, len(frame))))
    return frame[:start] + draw(st.lists(BYTES, max_size=3).map(bytes)) + frame[end:]


NOISE = GARBAGE | damaged() | FALSE_STARTS
STREAMS = st.lists(REQUEST_FRAMES | ANSWER_FRAMES | NOISE, max_size=7).map(b"".join)


@st.composite
def cut_streams(draw: st.DrawFn) -> tuple[bytes, list[bytes]]:
    stream = draw(STREAMS)
    return stream, pieces_of(stream, draw(st.lists(st.integers(0, len(stream)), max_size=12)))


@contextmanager
def short_frames_only() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(v1_frames, "MAX_FRAME", SMALL)
        patch.setattr(v1, "_MAX_FAST_DLEN", SMALL - 5)
        yield


@given(COMMANDS, BYTES, st.booleans(), st.booleans())
def test_a_command_round_trips(command: Command, seq: int, answer: bool, activity: bool) -> None:
    frame = V1.encode_command(command, seq, answer=answer, activity=activity)
    (request,) = heard([frame], Role.ROBOT)
    assert request == Request(command, seq, None, 0xFC | activity << 1 | answer, answer)
    assert V1.frame_of(request) == frame


@given(RESPONSES)
def test_a_response_round_trips(response: Response) -> None:
    frame = V1.encode_response(response)
    (heard_of,) = heard([frame])
    assert heard_of == response._replace(flags=0xFF)
    assert V1.frame_of(heard_of) == frame


@given(NOTIFICATIONS)
def test_a_notification_round_trips(notification: Notification) -> None:
    frame = V1.encode_notification(notification)
    for role in (Role.HOST, Role.OBSERVER):
        (heard_of,) = heard([frame], role)
        assert heard_of == notification._replace(flags=0xFE)
        assert V1.frame_of(heard_of) == frame


def test_what_v1_does_not_carry_is_left_out() -> None:
    assert V1.encode_command(Command(2, 0x30, b"", 0x12), 1) == V1.encode_command(Command(2, 0x30), 1)
    addressed = Response(1, 0, b"", 0x02, 0x30, 0x11, 0x01, 0x09)
    assert V1.encode_response(addressed) == V1.encode_response(Response(1, 0))


SAID = {
    (Generation.V1, Role.ROBOT): st.builds(Request, COMMANDS, BYTES, st.none(), st.just(0xFF), st.just(True)),
    (Generation.V1, Role.HOST): RESPONSES | NOTIFICATIONS,
    (Generation.V2, Role.ROBOT): st.builds(Request, COMMANDS, BYTES, st.none(), st.just(0x0A), st.just(True)),
    (Generation.V2, Role.HOST): st.one_of(
        st.tuples(BYTES, BYTES, PAYLOADS, BYTES, BYTES).map(lambda fields: Response(*fields, flags=0x09)),
        st.tuples(BYTES, BYTES, PAYLOADS).map(lambda fields: Notification(*fields, seq=0xFF, flags=0x08)),
    ),
}
STARTLESS = st.lists(st.integers(0, 0xFE).filter(lambda byte: byte != 0x8D), max_size=8).map(bytes)


@st.composite
def conversations(draw: st.DrawFn, generation: Generation) -> tuple[Role, list[ValidPacket], list[bytes]]:
    """Packets for one role, in pieces, with bytes between them that begin no frame of either codec."""
    role = draw(st.sampled_from((Role.HOST, Role.ROBOT)))
    packets = draw(st.lists(SAID[generation, role], max_size=6))
    codec = CODECS[generation]
    stream = draw(STARTLESS) + b"".join(codec.frame_of(packet) + draw(STARTLESS) for packet in packets)
    cuts = draw(st.lists(st.integers(0, len(stream)), max_size=10))
    return role, packets, pieces_of(stream, cuts)


@pytest.mark.parametrize("generation", [pytest.param(key, id=key.value) for key in Generation])
@given(data=st.data())
def test_both_codecs_get_what_was_sent(generation: Generation, data: st.DataObject) -> None:
    role, packets, pieces = data.draw(conversations(generation))
    assert valid_packets(decoded(CODECS[generation], pieces, role)) == packets


@given(st.sampled_from((Role.HOST, Role.ROBOT)), st.data())
def test_packets_are_received_as_sent_despite_noise(role: Role, data: st.DataObject) -> None:
    parts = data.draw(st.lists(st.tuples(NOISE, FRAMES[role]), min_size=1, max_size=6))
    stream, places = b"", []
    for noise, frame in parts:
        stream += noise
        places.append((len(stream), len(stream) + len(frame)))
        stream += frame
    by_chance = {(frame.start, frame.end) for frame in frames_in(stream, role.value, MAX_FRAME)}
    assume(by_chance == set(places))  # noise and frame together may happen to add up
    cuts = data.draw(st.lists(st.integers(0, len(stream)), max_size=10))
    packets = heard(pieces_of(stream, cuts), role)
    assert [V1.frame_of(packet) for packet in valid_packets(packets)] == [frame for _, frame in parts]


@given(cut_streams(), cut_streams(), st.sampled_from(Role))
def test_giving_up_leaves_nothing_behind(
    first: tuple[bytes, list[bytes]], second: tuple[bytes, list[bytes]], role: Role
) -> None:
    decoder = V1.decoder(role)
    for stream, pieces in (first, second):
        packets = [packet for piece in pieces for packet in decoder.feed(piece)] + decoder.give_up()
        assert raw_of(packets) == stream
        if role is not Role.OBSERVER:  # which remembers what was asked
            assert contents_of(packets) == contents_in(stream, role)


@given(cut_streams(), st.sampled_from(Role))
def test_any_cut_gives_the_same_packets(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    assert heard(pieces, role) == heard([stream], role) == heard(byte_by_byte(stream), role)


@given(cut_streams(), st.sampled_from(Role))
@example((b"\xff" * 70, [b"\xff" * 33, b"\xff" * 37]), Role.HOST)
def test_any_cut_gives_the_same_packets_at_the_bound(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    with short_frames_only():
        assert heard(pieces, role) == heard([stream], role) == heard(byte_by_byte(stream), role)


@given(cut_streams(), st.sampled_from(Role))
def test_every_byte_is_accounted_for(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    packets = heard(pieces, role)
    assert raw_of(packets) == stream
    assert all(packet.raw and packet.reason for packet in packets if isinstance(packet, Malformed))


@given(cut_streams(), st.sampled_from(Role))
def test_the_plain_decoder_agrees(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    assert contents_of(heard(pieces, role)) == contents_in(stream, role)


@given(cut_streams(), st.sampled_from(Role))
def test_the_plain_decoder_agrees_at_the_bound(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    stream, pieces = cut
    with short_frames_only():
        assert contents_of(heard(pieces, role)) == contents_in(stream, role, SMALL)


@given(cut_streams(), st.sampled_from(Role))
def test_at_most_two_frames_are_buffered(cut: tuple[bytes, list[bytes]], role: Role) -> None:
    _, pieces = cut
    given_bytes = reported = 0
    with short_frames_only():
        decoder = V1.decoder(role)
        for piece in pieces:
            given_bytes += len(piece)
            reported += len(raw_of(decoder.feed(piece)))
            assert given_bytes - reported < 2 * SMALL


@given(st.lists(st.binary(max_size=60), max_size=6), st.sampled_from(Role))
def test_nothing_on_the_line_raises(pieces: list[bytes], role: Role) -> None:
    assert raw_of(heard(pieces, role)) == b"".join(pieces)


@given(FRAMES[Role.HOST], st.data())
def test_a_flipped_bit_never_goes_unnoticed(frame: bytes, data: st.DataObject) -> None:
    at = data.draw(st.integers(2, len(frame) - 1))
    flipped = bytearray(frame)
    flipped[at] ^= 1 << data.draw(st.integers(0, 7))
    (packet,) = heard([frame])
    assert packet not in heard([bytes(flipped)])


def random_stream(random: Random) -> bytes:
    """The documents' frames in a row, some damaged, with noise and false lengths between them."""
    known = [PING, PONG, *(row["hex"] for row in GOLDEN.values()), "ffff0230070580005a01e6", DAMAGED_PONG]
    stream = bytearray()
    for _ in range(random.randrange(1, 7)):
        stream += bytes.fromhex(random.choice(known))
        stream += bytes(
            random.choice((0xFF, 0xFE, 0x00, 0x01, random.randrange(256))) for _ in range(random.randrange(4))
        )
        if not random.randrange(4):
            stream += bytes.fromhex(random.choice((FALSE_ASYNC, FALSE_RESPONSE, HUGE_ASYNC, "753e")))
    for _ in range(random.randrange(5)):
        at = random.randrange(len(stream))
        match random.randrange(4):
            case 0:
                stream[at] = random.choice((0xFF, 0xFE, 0x00, random.randrange(256)))
            case 1:
                del stream[at : at + random.randrange(1, 4)]
            case 2:
                stream[at:at] = stream[: random.randrange(1, 12)]
            case 3:
                stream[at] ^= 1 << random.randrange(8)
        if not stream:
            break
    return bytes(stream)


@EACH_ROLE
@pytest.mark.parametrize("seed", range(4))
def test_the_plain_decoder_agrees_on_damaged_streams(seed: int, role: Role) -> None:
    random = Random(seed)
    survivors = 0
    for _ in range(150):
        stream = random_stream(random)
        expected = contents_in(stream, role)
        survivors += len(expected)
        assert contents_of(heard([stream], role)) == expected
        cuts = [random.randrange(len(stream) + 1) for _ in range(random.randrange(6))]
        assert contents_of(heard(pieces_of(stream, cuts), role)) == expected
    assert survivors > 150
