"""What a redacted capture still tells: the robots' frames, and nothing that identifies."""

import io
import shutil
import struct
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.captures.link_layer import crc24_again
from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.pcapng_out import PcapngWriter
from sphero_probe.captures.reader import open_capture
from sphero_probe.captures.record import LINUX_MONITOR, NORDIC_SNIFFER, Record
from sphero_probe.captures.redaction.copy import Redaction
from sphero_probe.captures.redaction.hci import redacted_command, redacted_event
from sphero_probe.captures.redaction.pseudonyms import Pseudonyms
from sphero_probe.captures.redaction.records import redacted_record
from sphero_probe.captures.source import Source
from sphero_probe.catalogue.payload.fields import Field
from sphero_probe.errors import BadInputFileError
from sphero_probe.protocol.packets import Command, Generation, Malformed, Notification, Request, Response
from sphero_probe.protocol.v1 import V1
from tests.support import capture_writers as writers
from tests.support.capture_conversation import (
    START,
    Att,
    foreign,
    found_v1,
    found_v2,
    notify,
    v2_answer,
    v2_command,
    woven,
    write,
)
from tests.support.capture_radio import crc, radio
from tests.support.captures import CAPTURES
from tests.support.cli import Cli

TSHARK = shutil.which("tshark")
HOST, CLASSIC = "A4:5E:60:12:34:56", "00:1B:DC:0F:AB:CD"
PEER, V1_PEER = writers.PEERS[0], writers.PEERS[1]
LONG_NAME = "Ana's robot"
KEY = bytes(range(0xA0, 0xB0))
NAMES = ("BP-0000", "BP-0001", LONG_NAME, "Ana's phone", "Ana's earbuds", "anas-laptop", "Ana's thermometer")


def _digits(address: str) -> bytes:
    return address.replace(":", "").encode()


PERSONAL_V2 = [
    write(0x1C, v2_command(10, 0x11, 0x06)),
    notify(0x1C, v2_answer(10, 0x11, 0x06, _digits(PEER) + b"\0")[:9]),
    notify(0x1C, v2_answer(10, 0x11, 0x06, _digits(PEER) + b"\0")[9:]),
    write(0x1C, v2_command(11, 0x19, 0x03, LONG_NAME.encode() + b"\0")),
    write(0x1C, v2_command(12, 0x19, 0x04)),
    notify(0x1C, v2_answer(12, 0x19, 0x04, LONG_NAME.encode() + b"\0")),
    write(0x1C, v2_command(13, 0x77, 0x03, writers.address(PEER) + b"\x07" + LONG_NAME.encode())),
    notify(0x1C, v2_answer(13, 0x77, 0x03, PEER.lower().encode())),
    notify(0x1C, v2_answer(14, 0x11, 0x38, b"S-98765\0")),
    notify(0x1C, b"\x8d" + LONG_NAME.encode()),
    (True, b"\x0a\x03\x00"),
    (False, b"\x0b" + LONG_NAME.encode()),
    (True, b"\x08\x01\x00\xff\xff\x00\x2a"),
    (False, b"\x09" + bytes((len(LONG_NAME) + 2,)) + b"\x03\x00" + LONG_NAME.encode()),
]
PERSONAL_V1 = [
    write(0x0E, V1.encode_command(Command(0x00, 0x11), 20)),
    notify(
        0x11, V1.encode_response(Response(20, 0, b"BB-1234".ljust(16, b"\0") + _digits(V1_PEER) + b"rgb\0"))
    ),
    write(0x0E, V1.encode_command(Command(0x00, 0x10, b"Ana's ball\0"), 21)),
    notify(0x11, V1.encode_notification(Notification(None, 0x04, b"serial 4711"))),
]
TALK = woven([*found_v2(), *PERSONAL_V2], [*found_v1(), *PERSONAL_V1], foreign())
TEXTS = (*NAMES, "BB-1234", "Ana's ball", "serial 4711", "S-98765", "rgb is kept")[:-1]
ADDRESSES = (*writers.PEERS[:3], HOST, CLASSIC)


def _event(code: int, body: bytes) -> writers.Hci:
    return writers.Hci(START, 0, writers.EVENT, False, bytes((code, len(body))) + body)


def _command(opcode: int, body: bytes) -> writers.Hci:
    head = struct.pack("<HB", opcode, len(body))
    return writers.Hci(START, 0, writers.COMMAND, True, head + body)


def _completed(opcode: int, body: bytes) -> writers.Hci:
    return _event(0x0E, b"\x01" + struct.pack("<H", opcode) + body)


def _advertisement(peer: str, name: str) -> writers.Hci:
    data = bytes((len(name) + 1, 0x09)) + name.encode() + b"\x09\xff\x4c\x00" + writers.address(peer)
    return _event(0x3E, b"\x02\x01\x00\x01" + writers.address(peer) + bytes((len(data),)) + data + b"\xc8")


HOST_TRAFFIC = [
    _completed(0x1009, b"\0" + writers.address(HOST)),
    _command(0x0C13, b"Ana's phone".ljust(248, b"\0")),
    _completed(0x0C14, b"\0" + b"anas-laptop".ljust(248, b"\0")),
    _event(0x07, b"\0" + writers.address(CLASSIC) + b"Ana's earbuds".ljust(248, b"\0")),
    _event(0x18, writers.address(CLASSIC) + KEY + b"\x04"),
    _command(0x040B, writers.address(CLASSIC) + KEY),
    _command(0x2019, struct.pack("<H", 0x40) + KEY[:10] + KEY),
    _command(0x201A, struct.pack("<H", 0x40) + KEY),
    _command(0x2027, b"\x01" + writers.address(PEER) + KEY + KEY),
    _command(0x200D, bytes(6) + writers.address(PEER) + bytes(13)),
    _event(0x3E, b"\x05" + struct.pack("<H", 0x40) + KEY[:10]),
    _event(0x3E, b"\x0a\0\x99\0\0\1" + 3 * writers.address(writers.PEERS[2]) + bytes(7)),
    _advertisement(writers.PEERS[2], "Ana's thermometer"),
    _command(0xFC01, KEY),
    _event(0xFF, KEY),
]
HCI = [*HOST_TRAFFIC, *writers.hci(TALK)]
COMMENT = b"recorded by Ana on anas-laptop"


def commented(file: bytes) -> bytes:
    """Add what a pcapng file may say about its author: a section with options, and a block of names."""
    options = b"".join(writers.option("<", code, COMMENT) for code in (1, 2, 3, 4)) + bytes(4)
    body = struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1) + options
    names = writers.block("<", 4, struct.pack("<HH", 1, len(COMMENT)) + COMMENT + bytes(6))
    return writers.block("<", 0x0A0D0D0A, body) + file[28:] + names


FILES: Final[dict[str, Callable[[], bytes]]] = {
    "btsnoop 1001": lambda: writers.btsnoop(HCI, 1001),
    "btsnoop 2001": lambda: writers.btsnoop(HCI, 2001),
    "btsnoop, pieces of 5": lambda: writers.btsnoop([*HOST_TRAFFIC, *writers.hci(TALK, 5)]),
    "packetlogger": lambda: writers.packetlogger(HCI),
    "pcap 201": lambda: writers.pcap(writers.as_raw(HCI, 201)),
    "pcapng 187": lambda: commented(writers.pcapng(writers.as_raw(HCI, 187))),
    "pcap 251": lambda: writers.pcap(radio(TALK, 251)),
    "pcap 256": lambda: writers.pcap(radio(TALK, 256)),
    "pcap 272": lambda: writers.pcap(radio(TALK, 272)),
}


def redacted(file: bytes, seed: bytes = b"a seed") -> bytes:
    redaction = Redaction(Pseudonyms(seed))
    capture = open_capture(Source(io.BytesIO(file)), "a file")
    assert capture
    redaction.learn(capture)
    writer = PcapngWriter("a test")
    return writer.start() + b"".join(map(writer.packet, redaction.copy(Source(io.BytesIO(file)))))


def packets(file: bytes) -> list[CapturedPacket]:
    capture = open_capture(Source(io.BytesIO(file)), "a file")
    assert capture
    return list(capture.packets())


def forms(address: str) -> list[bytes]:
    octets = bytes.fromhex(address.replace(":", ""))
    found: list[bytes] = []
    for way in (octets, octets[::-1]):
        found += [way, *(way.hex(mark).encode() for mark in ":-"), way.hex().encode()]
    return found + [one.upper() for one in found]


@pytest.mark.parametrize("kind", FILES)
def test_nothing_that_identifies_stays_and_every_frame_does(kind: str) -> None:
    file = FILES[kind]()
    made = redacted(file)
    before, after = packets(file), packets(made)
    all_before = file + b"".join(at.raw for at in before)
    all_after = made + b"".join(at.raw for at in after)
    there = [form for address in ADDRESSES for form in forms(address) if form in all_before]
    assert _digits(PEER) in there
    for form in there:
        assert form not in all_after, form
    for text in TEXTS:
        assert text.encode() not in all_after, text
        assert text.encode().hex().encode() not in all_after
    assert KEY[:10] not in made
    assert COMMENT[:8] not in made
    facts = [
        [(at.connection.number, at.to_robot, at.time, at.handle, type(at.packet)) for at in read]
        for read in (before, after)
    ]
    assert facts[0] == facts[1]
    unchanged = [one.raw == other.raw for one, other in zip(before, after, strict=True)]
    damaged = [isinstance(at.packet, Malformed) for at in before]
    assert sum(not same for same in unchanged) in {10, 11}
    assert sum(damaged) == 1


def test_the_same_gets_the_same_everywhere() -> None:
    after = [at for at in packets(redacted(FILES["pcap 201"]())) if at.generation is Generation.V2]
    (peer,) = {at.connection.peer for at in after}
    assert peer
    payloads = [getattr(at.packet, "payload", b"") for at in after]
    assert peer.replace(":", "").encode() + b"\0" in payloads
    assert peer.lower().encode() in payloads
    asked = [at.packet.command for at in after if isinstance(at.packet, Request)]
    (told,) = (payload for did, cid, payload, *_ in asked if (did, cid) == (0x77, 3))
    assert told[:7] == writers.address(peer) + b"\x07"
    assert told[7:] + b"\0" in payloads
    assert (after[0].connection.name or "").startswith("BP-")


def test_another_seed_gives_other_pseudonyms_and_the_same_the_same() -> None:
    file = FILES["pcap 201"]()
    assert redacted(file) == redacted(file)
    assert redacted(file, b"1") != redacted(file, b"2")


@pytest.mark.parametrize("kind", CAPTURES)
def test_what_does_not_identify_is_as_it_was(kind: str) -> None:
    file = CAPTURES[kind]()
    before, after = packets(file), packets(redacted(file))
    facts = [[(at.raw, at.time or 0, at.to_robot) for at in read] for read in (before, after)]
    assert facts[0] == facts[1]


@given(st.binary(min_size=1, max_size=16), st.sampled_from(["btsnoop, pieces of 5", "pcap 256", "pcap 272"]))
def test_checksums_fit_whatever_stands_for_a_name(seed: bytes, kind: str) -> None:
    made = redacted(FILES[kind](), seed)
    assert sum(isinstance(at.packet, Malformed) for at in packets(made)) == 1


@given(st.binary(max_size=40), st.binary(max_size=40), st.integers(0, 0xFFFFFF))
def test_a_radio_checksum_is_made_again_without_its_start_value(old: bytes, new: bytes, seed: int) -> None:
    assert crc24_again(old, crc(old, seed), new) == crc(new, seed)


@given(st.binary(min_size=6, max_size=6), st.binary(min_size=1, max_size=40), st.binary(max_size=64))
def test_pseudonyms_are_as_long_and_do_not_change_twice(address: bytes, name: bytes, salt: bytes) -> None:
    pseudonyms = Pseudonyms(salt)
    made = pseudonyms.address(address)
    assert pseudonyms.address(made) == made
    assert pseudonyms.reversed_address(address[::-1]) == made[::-1]
    assert len(pseudonyms.name(name)) == len(name)
    text = b"at " + address.hex(":").encode()
    assert pseudonyms.everywhere(text).lower() == b"at " + made.hex(":").encode()
    assert len(pseudonyms.value(Field("id", "u32"), name)) == len(name)


@pytest.mark.slow
@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
@pytest.mark.parametrize("kind", FILES)
def test_tshark_opens_it_and_finds_nothing_malformed(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "shared.pcapng"
    path.write_bytes(redacted(FILES[kind]()))
    shown = ("-T", "fields", "-e", "_ws.malformed", "-e", "btle.crc.incorrect", "-e", "frame.protocols")
    command = (TSHARK or "", "-n", "-o", "btle.detect_retransmit:FALSE", "-r", str(path), *shown)
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = [line.split("\t") for line in ran.stdout.splitlines()]
    assert any("btatt" in row[2] for row in rows)
    assert not [row for row in rows if row[0] or row[1]]


def test_the_command_line(cli: Cli, tmp_path: Path) -> None:
    source, made = tmp_path / "source", tmp_path / "made.pcapng"
    source.write_bytes(FILES["btsnoop 2001"]())
    ran = cli("capture", "redact", str(source), "-o", str(made))
    assert ran.code == 0, ran.err
    assert "Replaced: " in ran.err
    assert LONG_NAME.encode() not in made.read_bytes()
    first = cli("capture", "redact", str(source), "-o", str(made), "--seed", "7")
    seeded = made.read_bytes()
    again = cli("capture", "redact", str(source), "-o", str(made), "--seed", "7")
    assert (first.code, again.code, made.read_bytes()) == (0, 0, seeded)
    assert cli("capture", "redact", str(source), "-o", str(source)).code == 2
    assert cli("capture", "redact", str(source), "-o", str(tmp_path / "none" / "made")).code == 10
    assert cli("capture", "redact", str(tmp_path / "none"), "-o", str(made)).code == 8


@pytest.mark.parametrize("link", [147, 250])
def test_a_serial_line_is_redacted_too(link: int) -> None:
    said = [(True, v2_command(1, 0x11, 0x06)), (False, v2_answer(1, 0x11, 0x06, _digits(PEER) + b"\0"))]
    raw = [
        writers.Raw(
            START, link, (bytes(8) + bytes((1 if sent else 2, 0, 0, 0)) if link == 250 else b"") + piece, sent
        )
        for sent, data in said
        for piece in (data[:7], data[7:])
        if piece
    ]
    made = redacted(writers.pcapng(raw))
    after = packets(made)
    assert [at.to_robot for at in after] == [True, False]
    assert after[0].raw == said[0][1]
    assert not isinstance(after[1].packet, Malformed)
    assert _digits(PEER) not in made + after[1].raw
    assert len(getattr(after[1].packet, "payload", b"")) == 13


@settings(max_examples=60)
@given(
    st.sampled_from(sorted(FILES)),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 9), st.binary(max_size=5)), min_size=1, max_size=4),
)
def test_a_damaged_capture_is_redacted_as_far_as_it_is_read(
    kind: str, cuts: list[tuple[float, int, bytes]]
) -> None:
    file = FILES[kind]()
    for place, removed, put_in in cuts:
        at = int(place * len(file))
        file = file[:at] + put_in + file[at + removed :]
    with suppress(BadInputFileError):
        if open_capture(Source(io.BytesIO(file)), "a file"):
            made = redacted(file)
            assert KEY not in made
            assert COMMENT not in made


NAMED = b"\x0cZoe's ball\0"
"""A value with a name that nothing else in the capture tells."""


def with_v1(*said: tuple[bool, bytes]) -> list[Att]:
    return woven([*found_v2(), *PERSONAL_V2], [*found_v1(), *PERSONAL_V1, *said], foreign())


@pytest.mark.parametrize(
    "record",
    [
        pytest.param(_event(0x3E, b"\x11\0\0" + b"Zoe's ball"), id="a report became another event"),
        pytest.param(_command(0x200D, bytes(12) + b"Zoe's ball"), id="a name became parameters"),
        pytest.param(
            _event(0x3E, b"\x02\1\0\1" + bytes(6) + b"\x0c\x0b\x0dZoe's ball" + b"\xc0"), id="name as class"
        ),
        pytest.param(
            _event(0x3E, b"\x02\1\0\1" + bytes(6) + b"\x0c\x0b\x03Zoe's ball" + b"\xc0"),
            id="name as services",
        ),
    ],
)
def test_a_name_in_the_wrong_place_does_not_stay(record: writers.Hci) -> None:
    """Each was found by damaging captures at random."""
    made = redacted(writers.btsnoop([record, *HCI]))
    assert b"Zoe's ball" not in made


@pytest.mark.parametrize("opcode", [0x05, 0x07, 0x08, 0x10, 0x11])
def test_a_value_that_looks_like_discovery_does_not_stay(opcode: int) -> None:
    value = bytes((opcode,)) + NAMED.rjust(20, b"\1")
    assert b"Zoe's ball" not in redacted(writers.btsnoop(writers.hci(with_v1((False, value)))))


@pytest.mark.parametrize("link", [251, 256, 272])
def test_what_a_damaged_length_swallows_does_not_stay(link: int) -> None:
    raw = [packet._replace(data=packet.data + b"Zoe's ball") for packet in radio(TALK, link)]
    made = redacted(writers.pcap(raw))
    assert len(made) > sum(len(packet.data) for packet in raw) / 4
    assert b"Zoe's ball" not in made


def test_an_answer_to_another_command_than_it_seems_keeps_no_text() -> None:
    """In V1, damage to the id of a command makes its answer that of another one."""
    name = bytes.fromhex("ffff0014") + bytes((len(NAMED) + 1,)) + NAMED
    answer = name + bytes((~sum(name[2:]) & 0xFF,))
    command = bytes.fromhex("ffff02201401")
    said = [write(0x0E, command + bytes((~sum(command[2:]) & 0xFF,))), notify(0x11, answer)]
    made = redacted(writers.btsnoop(writers.hci(with_v1(*said))))
    assert b"Zoe's ball" not in made


WITH_KEYS = {
    "encryption is enabled": struct.pack("<H", 0x40) + KEY[:10] + KEY,
    "a long term key": struct.pack("<H", 0x40) + KEY,
    "a link key": bytes(6) + KEY,
    "a link key is told": bytes(6) + KEY + b"\x04",
    "identities": bytes(7) + KEY + KEY,
    "out of band": bytes(6) + KEY + KEY,
    "from the vendor": KEY,
}


@pytest.mark.parametrize("body", WITH_KEYS.values(), ids=WITH_KEYS)
def test_no_damage_to_a_code_keeps_a_key(body: bytes) -> None:
    """As any command, any event, and what any command returns."""
    pseudonyms = Pseudonyms(b"a seed")
    made = [
        redacted_command(struct.pack("<HB", opcode, len(body)) + body, pseudonyms)
        for opcode in range(1 << 16)
    ]
    returned = [struct.pack("<BH", 1, opcode) + body for opcode in range(1 << 16)]
    made += [redacted_event(bytes((0x0E, len(told))) + told, pseudonyms) for told in returned]
    for code in set(range(256)) - {0x0E}:
        first = range(256) if code == 0x3E else [body[0]]
        made += [redacted_event(bytes((code, len(body), one)) + body[1:], pseudonyms) for one in first]
    assert all(one is not None for one in made)
    assert not [one for one in made if one and KEY[:10] in one]


@pytest.mark.parametrize("opcode", [0, 1, 8, 9, 10])
def test_a_monitor_record_that_became_another_keeps_no_name(opcode: int) -> None:
    data = struct.pack(">HH", 0, opcode) + b"\x3e\x29\x02\1\0\1" + bytes(6) + b"\x0c\x0b\x09Zoe's ball\xc0"
    made = redacted_record(Record(START, LINUX_MONITOR, data, 0, sent=None), Pseudonyms(b"a seed"))
    assert made is None or b"Zoe's ball" not in made.data


def test_a_sniffer_header_of_another_length_is_left_out() -> None:
    whole = next(packet for packet in radio(TALK, NORDIC_SNIFFER) if len(packet.data) > 30)
    for length in {*range(256)} - {10}:
        data = whole.data[:7] + bytes((length,)) + whole.data[8:]
        assert redacted_record(Record(START, NORDIC_SNIFFER, data, 0, sent=None), Pseudonyms(b"")) is None


def test_a_name_that_answers_a_damaged_request_does_not_stay() -> None:
    """Its request asks for services where it had asked for the name."""
    said = [
        (True, bytes.fromhex("080100ffff0028")),
        (False, b"\x09" + bytes((len(NAMED) + 2,)) + b"\x03\0" + NAMED),
    ]
    assert b"Zoe's ball" not in redacted(writers.btsnoop(writers.hci(with_v1(*said))))
