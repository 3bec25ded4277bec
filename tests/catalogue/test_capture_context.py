"""Completing the packets of a capture from earlier packets and from the catalogue."""

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.autodetect import AutoDecoder
from sphero_probe.protocol.packets import (
    Command,
    Generation,
    Malformed,
    Notification,
    Packet,
    Request,
    Response,
    Role,
)

V1, V2 = Generation.V1, Generation.V2


def heard(text: str, generation: Generation = V2, robot: str | None = None) -> list[Packet]:
    """Decode hex as an observer, and complete every packet."""
    context = CaptureContext(ROBOTS[robot] if robot else None)
    decoder = CODECS[generation].decoder(Role.OBSERVER)
    packets = decoder.feed(bytes.fromhex(text)) + decoder.give_up()
    completed = [context.complete(generation, packet) for packet in packets]
    frames = [CODECS[generation].frame_of(packet) for packet in completed]
    assert b"".join(frames) == bytes.fromhex(text)
    return completed


def v1(command: Command, seq: int, *, answer: bool = True) -> str:
    return CODECS[V1].encode_command(command, seq, answer=answer).hex()


def answer(seq: int, payload: bytes = b"", code: int = 0) -> str:
    return CODECS[V1].encode_response(Response(seq, code, payload)).hex()


def test_a_v1_response_is_named_after_the_command_with_its_sequence_number() -> None:
    capture = (
        v1(Command(0x00, 0x20), 0x52)
        + v1(Command(0x02, 0x22), 0x53)
        + answer(0x53, b"\xff\0\0")
        + answer(0x52, bytes.fromhex("010202ef000a0100"))
        + answer(0x54)
    )
    *_, colour, power, stray = heard(capture, V1)
    assert isinstance(colour, Response)
    assert isinstance(power, Response)
    assert isinstance(stray, Response)
    assert (colour.did, colour.cid) == (0x02, 0x22)
    assert (power.did, power.cid) == (0x00, 0x20)
    assert (stray.did, stray.cid) == (None, None)


def test_a_sequence_number_that_is_used_again_means_the_last_command_that_wanted_an_answer() -> None:
    capture = (
        v1(Command(0x00, 0x01), 1)
        + answer(1)
        + v1(Command(0x02, 0x30, bytes(4)), 1, answer=False)
        + answer(1)
        + v1(Command(0x02, 0x07), 1)
        + answer(1, b"\1")
    )
    named = [(packet.did, packet.cid) for packet in heard(capture, V1) if isinstance(packet, Response)]
    assert named == [(0x00, 0x01), (0x00, 0x01), (0x02, 0x07)]


@pytest.mark.parametrize(
    ("frame", "kind"),
    [
        pytest.param("8d1801130dffc7d8", Request, id="the SDK's wake with SEQ 0xFF"),
        pytest.param("8d28011311ffb3d8", Notification, id="RVR awake, real"),
        pytest.param("8d2801131affaad8", Notification, id="RVR did sleep, real"),
        pytest.param("8d081311ffd4d8", Notification, id="R2-D2 awake, real"),
        pytest.param("8d3a0101130d01a2d8", Request, id="a command that asks for an answer, real"),
        pytest.param("8d21011106ff0064656339353461656430663603d8", Response, id="SEQ 0xFF, real"),
    ],
)
def test_the_catalogue_tells_commands_from_notifications(frame: str, kind: type[Packet]) -> None:
    (packet,) = heard(frame)
    assert isinstance(packet, kind)


def v2(packet: Packet) -> str:
    return CODECS[V2].frame_of(packet).hex()


@pytest.mark.parametrize(
    ("did", "cid", "target", "source", "kind"),
    [
        pytest.param(0x13, 0x0D, None, None, Request, id="a command, by the catalogue"),
        pytest.param(0x13, 0x1A, None, None, Notification, id="a notification, by the catalogue"),
        pytest.param(0x13, 0x1F, None, None, Notification, id="both, by robot: as it looks"),
        pytest.param(0x77, 0x00, None, None, Notification, id="unknown: as it looks"),
        pytest.param(0x13, 0x0D, None, 2, Notification, id="it has a source but no target"),
        pytest.param(0x77, 0x00, 1, None, Request, id="unknown, to a node"),
        pytest.param(0x13, 0x1A, 1, None, Notification, id="a notification to a client"),
    ],
)
def test_frames_without_an_answer_flag_and_with_seq_255(
    did: int, cid: int, target: int | None, source: int | None, kind: type[Packet]
) -> None:
    (packet,) = heard(v2(Notification(did, cid, b"", source, target, 0xFF, 0x08)))
    assert isinstance(packet, kind)
    assert not isinstance(packet, Malformed)
    assert packet.flags & 0x08
    if isinstance(packet, Request):
        assert packet.command == Command(did, cid, b"", target)
        assert not packet.wants_answer


def test_a_notification_with_another_sequence_number_is_one_all_the_same() -> None:
    (packet,) = heard(v2(Request(Command(0x18, 0x02, b"\0\0\0\0"), 7, 2, 0x08, wants_answer=False)))
    assert packet == Notification(0x18, 0x02, b"\0\0\0\0", 2, None, 7, 0x28)
    (command,) = heard(v2(Request(Command(0x18, 0x00, bytes(7)), 7, None, 0x08, wants_answer=False)))
    assert isinstance(command, Request)


def test_the_robot_decides_where_it_is_known() -> None:
    frame = v2(Notification(0x13, 0x1F, b"", None, None, 0xFF, 0x08))
    (packet,) = heard(frame, robot="bolt")
    assert isinstance(packet, Request)


def test_a_damaged_frame_before_a_valid_one_is_reported_for_its_checksum() -> None:
    decoder = AutoDecoder()
    first, second = decoder.feed(bytes.fromhex("ffff000001ffffff000001fe")) + decoder.end()
    assert isinstance(first.packet, Malformed)
    assert (first.packet.raw.hex(), first.packet.reason) == ("ffff000001ff", "checksum 0xff, expected 0xfe")
    assert isinstance(second.packet, Response)
