"""Every container and link type gives the packets of the conversation that they were written from."""

import io

import pytest

from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.reader import Capture, open_capture
from sphero_probe.captures.source import Source
from sphero_probe.errors import BadInputFileError
from sphero_probe.protocol.packets import Malformed, Request
from tests.support import capture_writers as writers
from tests.support.capture_conversation import (
    START,
    V1_FRAMES,
    V2_FRAMES,
    Att,
    cached_v1,
    foreign,
    found_v2,
    notify,
    v2_answer,
    v2_command,
    woven,
    write,
)
from tests.support.capture_radio import Air
from tests.support.captures import CAPTURES, TALK


def opened(file: bytes) -> Capture:
    capture = open_capture(Source(io.BytesIO(file)), "a file")
    assert capture
    return capture


def packets(file: bytes) -> list[CapturedPacket]:
    return list(opened(file).packets())


def frames(file: bytes) -> list[bytes]:
    return [packet.raw for packet in packets(file)]


def att(capture: Capture) -> list[tuple[bool | None, bytes]]:
    return [(packet.sent, packet.data) for packet in capture.att_packets()]


@pytest.mark.parametrize("kind", CAPTURES)
def test_every_att_packet_is_read(kind: str) -> None:
    read = list(opened(CAPTURES[kind]()).att_packets())
    assert [(packet.sent, packet.data) for packet in read] == [(said.sent, said.data) for said in TALK]
    lines = list(dict.fromkeys(packet.line for packet in read))
    assert [lines.index(packet.line) for packet in read] == [said.connection for said in TALK]


@pytest.mark.parametrize("kind", CAPTURES)
def test_every_frame_is_read_once_and_robots_stay_apart(kind: str) -> None:
    capture = opened(CAPTURES[kind]())
    read = list(capture.packets())
    by_robot: dict[int, list[bytes]] = {}
    for packet in read:
        by_robot.setdefault(packet.connection.number, []).append(packet.raw)
    assert sorted(by_robot.values()) == sorted([V2_FRAMES, V1_FRAMES, V1_FRAMES])
    assert not any(isinstance(packet.packet, Malformed) for packet in read)
    for packet in read:
        assert packet.to_robot is isinstance(packet.packet, Request)
    assert capture.cut is None
    names = {packet.connection.name for packet in read}
    assert names == ({"BP-0000", "BP-0001", "BP-0003"} if "simple" not in kind else names)


@pytest.mark.parametrize("kind", [kind for kind in CAPTURES if "simple" not in kind])
def test_times_are_those_of_the_conversation(kind: str) -> None:
    read = list(opened(CAPTURES[kind]()).att_packets())
    off = [abs((packet.time or 0) - said.time * 1000) for packet, said in zip(read, TALK, strict=True)]
    radio = any(link in kind for link in ("251", "256", "272"))
    assert max(off) <= (5_000_000 if radio else 1_000)


def test_a_packet_tells_how_it_was_cut() -> None:
    read = packets(CAPTURES["btsnoop 1002"]())
    parts = {packet.raw: packet.parts for packet in read}
    assert parts[v2_answer(3, 0x1A, 0x1C)] == (5, len(v2_answer(3, 0x1A, 0x1C)) - 5)
    assert parts[v2_command(1, 0x13, 0x10)] == (len(v2_command(1, 0x13, 0x10)),)


def test_one_robot_by_traffic_alone() -> None:
    talk = [write(0x52, v2_command(5, 0x13, 0x10)), notify(0x1B, v2_answer(5, 0x13, 0x10, b"\x01"))]
    assert frames(writers.btsnoop(writers.hci(woven(talk), opened=False))) == [talk[0][1][3:], talk[1][1][3:]]


def test_a_single_frame_that_nothing_answers_tells_no_robot() -> None:
    capture = opened(writers.btsnoop(writers.hci(woven([write(0x52, v2_command(5, 0x13, 0x10))]))))
    assert not list(capture.packets())
    assert "no Sphero, 1 frame without an answer, too few to tell a robot" in capture.said


def test_a_foreign_capture_gives_nothing_and_says_what_was_in_it() -> None:
    capture = opened(writers.btsnoop(writers.hci(woven(foreign()))))
    assert not list(capture.packets())
    assert capture.said.startswith("btsnoop: ")
    assert "61 values, no Sphero" in capture.said


def test_a_handle_that_is_used_again_is_another_connection() -> None:
    first = writers.hci(woven(found_v2()[:11]))
    later = [
        Att(said.time + 60_000_000, 0, said.sent, said.data)
        for said in woven([*foreign()[:2], notify(0x1C, v2_answer(9, 0x13, 0x10)), *cached_v1()])
    ]
    middle = writers.disconnected(START + 50_000_000, 0x40)
    read = packets(writers.btsnoop([*first, middle, *writers.hci(later)]))
    assert [packet.raw for packet in read if packet.connection.number == 1] == V2_FRAMES[:3]
    assert [packet.raw for packet in read if packet.connection.number == 2] == V1_FRAMES


def test_two_adapters_use_the_same_handle() -> None:
    said = woven(found_v2(), cached_v1())
    mixed = [hci for packet in said for hci in writers.acl(packet, 9, 0x40, adapter=packet.connection)]
    for file in (writers.btsnoop(mixed, 2001), writers.pcap(writers.as_raw(mixed, 254))):
        read = packets(file)
        assert [packet.raw for packet in read if packet.connection.number == 1] == V2_FRAMES
        assert [packet.raw for packet in read if packet.connection.number == 2] == V1_FRAMES


def test_parts_that_lack_their_start_are_counted_and_not_used() -> None:
    whole = writers.hci(woven(found_v2()), 9)
    starts = [
        at for at, packet in enumerate(whole) if packet.kind == writers.ACL and packet.data[1] >> 4 & 3 != 1
    ]
    capture = opened(writers.btsnoop(whole[: starts[6]] + whole[starts[6] + 1 :]))
    read = list(capture.packets())
    assert capture.counts["parts without a start"] >= 1
    assert {packet.raw for packet in read} <= set(V2_FRAMES)


def test_damage_is_shown_once_with_its_reason() -> None:
    bad = bytearray(v2_answer(1, 0x13, 0x10))
    bad[-2] ^= 0xFF
    talk = [*found_v2(), notify(0x1C, bytes(bad))]
    read = packets(writers.btsnoop(writers.hci(woven(talk))))
    damaged = [packet for packet in read if isinstance(packet.packet, Malformed)]
    assert [packet.raw for packet in damaged] == [bytes(bad)]


@pytest.mark.parametrize("kind", CAPTURES)
def test_nothing_in_a_sound_capture_is_doubtful(kind: str) -> None:
    assert not any(packet.doubt for packet in packets(CAPTURES[kind]()))


def doubts(*values: bytes) -> list[tuple[str, str]]:
    """Frame and doubt of each packet that a V1 robot gets in these writes."""
    talk = [*cached_v1(), *(write(0x0E, value) for value in values)]
    read = packets(writers.btsnoop(writers.hci(woven(talk))))
    return [(packet.raw.hex(), packet.doubt) for packet in read[len(V1_FRAMES) :]]


def test_a_v1_frame_that_damage_may_have_made_is_marked() -> None:
    ping, quiet = bytes.fromhex("ffff00012201db"), bytes.fromhex("fffe00012301da")
    first, again = doubts(quiet, ping, quiet)[::2]
    assert first == (quiet.hex(), "flags that no checksum covers, for the first time on this connection")
    assert again == (quiet.hex(), "")
    assert doubts(b"\x01\x02" + ping) == [("0102", ""), (ping.hex(), "next to damaged bytes")]
    assert doubts(ping + b"\x01\x02", ping)[0] == (ping.hex(), "next to damaged bytes")
    assert doubts(ping + ping[:1], ping[1:]) == [(ping.hex(), ""), (ping.hex(), "")]


@pytest.mark.parametrize("kind", CAPTURES)
def test_a_cut_file_gives_all_whole_records(kind: str) -> None:
    file = CAPTURES[kind]()
    everything = frames(file)
    for size in range(len(file) // 3, len(file) - 1, len(file) // 17):
        capture = opened(file[:size])
        read = [packet.raw for packet in capture.packets() if not isinstance(packet.packet, Malformed)]
        assert set(read) <= set(everything)
        assert capture.cut is None or (
            capture.cut <= size and f"cut after {capture.cut} bytes" in capture.said
        )
    capture = opened(file[:-1])
    assert list(capture.packets())
    assert capture.cut is not None
    assert capture.cut < len(file)


def test_an_encrypted_connection_on_the_air_is_said_to_be() -> None:
    air = Air(256)
    air.advertise(START, 0)
    air.send(START + 10_000, 0, 3, b"\x05", sent=False)
    air.send(START + 20_000, 0, 2, writers.l2cap(write(0x1C, v2_command(5, 0x13, 0x10))[1]), sent=True)
    capture = opened(writers.pcap(air.packets))
    assert not list(capture.packets())
    assert "packets of encrypted connections: 1, record HCI on the host" in capture.said


@pytest.mark.parametrize("ways", [True, False], ids=["both ways told apart", "one stream"])
def test_serial_lines(ways: bool) -> None:
    said = [(True, V2_FRAMES[0]), (False, V2_FRAMES[1][:4]), (False, V2_FRAMES[1][4:]), (True, V2_FRAMES[2])]
    if ways:
        raw = [
            writers.Raw(START + at, 250, bytes(8) + bytes((1 if sent else 2, 0, 0, 0)) + data)
            for at, (sent, data) in enumerate(said)
        ]
    else:
        raw = [writers.Raw(START + at, 147, data) for at, (_, data) in enumerate(said)]
    read = packets(writers.pcap(raw))
    assert [packet.raw for packet in read] == V2_FRAMES[:3]
    assert [packet.to_robot for packet in read] == ([True, False, True] if ways else [None] * 3)


def test_a_serial_line_in_pcapng_tells_direction_by_its_flags() -> None:
    raw = [
        writers.Raw(START, 147, V2_FRAMES[0], sent=True),
        writers.Raw(START, 147, V2_FRAMES[1], sent=False),
    ]
    assert [packet.to_robot for packet in packets(writers.pcapng(raw))] == [True, False]


@pytest.mark.parametrize(
    ("file", "message"),
    [
        pytest.param(
            writers.pcap([writers.Raw(START, 1, bytes(60))]), "pcap of packets of link type 1", id="Ethernet"
        ),
        pytest.param(writers.btsnoop([], 1003), "btsnoop datalink 1003 is not read", id="datalink"),
        pytest.param(writers.btsnoop([])[:12], "btsnoop, cut inside its header", id="cut header"),
        pytest.param(b"PK\x03\x04" + bytes(40), "zip files are not read", id="zip"),
    ],
)
def test_what_cannot_be_read_says_so(file: bytes, message: str) -> None:
    with pytest.raises(BadInputFileError, match=message) as caught:
        frames(file)
    assert "tshark" in caught.value.hint


@pytest.mark.parametrize(
    "file", [b"", b"\x8d", b"8d 0a 13 10 07 cb d8", b"\xff\xff\x00\x01\x01\xfd" * 9, b"btsnoo"]
)
def test_what_is_no_capture_is_none(file: bytes) -> None:
    assert open_capture(Source(io.BytesIO(file)), "a file") is None


def test_an_unread_interface_beside_a_read_one_is_counted() -> None:
    raw = [writers.Raw(START, 1, bytes(60)), *writers.as_raw(writers.hci(woven(found_v2())), 201)]
    capture = opened(writers.pcapng(raw))
    assert [packet.raw for packet in capture.packets()] == V2_FRAMES
    assert "packets of link type 1: 1" in capture.said
