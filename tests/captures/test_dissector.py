"""The Wireshark dissector: what the script holds, and what tshark reads with it."""

import io
import json
import random
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree as ET

import pytest

from sphero_probe.captures.dissector import dissector, quoted
from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.pairing import Pairing
from sphero_probe.captures.pcapng_out import PcapngWriter
from sphero_probe.captures.reader import open_capture
from sphero_probe.captures.record import USER_SERIAL, Record
from sphero_probe.captures.source import Source
from sphero_probe.captures.synthetic import BleScript, Script, SerialScript
from sphero_probe.catalogue import DEVICE_NAMES, all_rows, rows_of
from sphero_probe.catalogue.gatt import PROFILES
from sphero_probe.catalogue.model import Kind
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.payload.layout import Layout
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
from sphero_probe.protocol.v2 import V2
from tests.support.capture_conversation import foreign, found_v1, found_v2, woven
from tests.support.capture_writers import as_raw, hci, pcapng

if TYPE_CHECKING:
    from sphero_probe.captures.record import Record

TSHARK = shutil.which("tshark")
GOLDEN = Path(__file__).parents[1] / "data" / "golden_frames.json"
START = 1_700_000_000_000_000_000
STEP = 1_500_000
FIELD = "sphero.payload.field"

with_tshark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")

Frame = tuple[bool, bytes]
"""Whether it is sent to the robot, and its bytes."""


class Seen(NamedTuple):
    """What is compared of a packet."""

    kind: str
    generation: int | None = None
    flags: int | None = None
    target: int | None = None
    source: int | None = None
    did: int | None = None
    cid: int | None = None
    seq: int | None = None
    code: int | None = None
    code_name: str | None = None
    payload: bytes = b""
    checksum_ok: bool | None = None
    reason: str | None = None
    answered_after: int | None = None
    raw: bytes = b""


def test_the_script_is_the_same_each_time() -> None:
    assert dissector("1.0") == dissector("1.0")
    assert "--@CATALOGUE@" not in dissector("1.0")


@pytest.mark.parametrize("generation", Generation)
def test_every_device_command_and_code_is_in_it(generation: Generation) -> None:
    script = dissector("1.0")
    for did, name in DEVICE_NAMES[generation].items():
        assert f'[{did}] = "{name}"' in script
    for row in all_rows(generation):
        table = rf"catalogue\.{generation}\.{row.kind.value}s\[0x{row.did << 8 | row.cid:04x}\]"
        line = re.search(table + r" = \{ name = (\".*?\"), request", script)
        assert line, row.name
        assert row.name in line[1].strip('"').split(" / ")
    for code in range(12):
        assert f'[{code}] = "{CODECS[generation].code_name(code)}"' in script or code == 11
    for profile in PROFILES:
        assert profile.commands in script
        assert profile.answers in script


def test_a_string_ends_only_at_its_end() -> None:
    assert quoted('a "b" \\ \n é') == '"a \\034b\\034 \\092 \\010 \\195\\169"'


def golden(generation: Generation) -> list[Frame]:
    rows = json.loads(GOLDEN.read_text(encoding="utf-8"))
    return [
        (row["direction"] == "tx", bytes.fromhex(row["hex"]))
        for row in rows
        if row["protocol"] == generation and row["direction"] in ("tx", "rx")
    ]


def made_up(generation: Generation, count: int, seed: int) -> Iterator[Frame]:
    """Yield random packets, some of them damaged, and commands with their answers."""
    rng = random.Random(seed)
    codec = CODECS[generation]
    rows = all_rows(generation)
    second = generation is Generation.V2
    for number in range(count):
        row, seq = rng.choice(rows), number % 250
        did, cid = (row.did, row.cid) if rng.random() < 0.8 else (rng.randrange(256), rng.randrange(1, 256))
        size = rng.choice((0, 1, 2, 3, 4, 8, 16, rng.randrange(200)))
        payload = bytes(rng.choice((rng.randrange(256), 0x8D, 0xD8, 0xAB)) for _ in range(size))
        target = rng.choice((None, 0x11, 0x12, 0x10)) if second else None
        sent = codec.encode_command(Command(did, cid, payload, target), seq)
        response = Response(seq, rng.choice((0, 0, 1, 6, 8, 200)), payload[:50])
        told = Notification(None, cid, payload)
        if second:
            source = rng.choice((None, target, 0x12))
            response = response._replace(did=did, cid=cid, source=source, flags=1)
            told = told._replace(did=did, source=rng.choice((None, 0x11)), seq=0xFF, flags=0x08)
        received = codec.encode_response(response)
        yield True, sent
        yield False, received
        if number % 3 == 0:
            yield False, codec.encode_notification(told)
        if number % 10 == 0:
            yield rng.choice(((True, damaged(sent)), (False, damaged(received))))


def damaged(frame: bytes) -> bytes:
    """Return a frame whose checksum does not fit."""
    at = 5 if frame[0] == 0xFF else len(frame) - 2
    flipped = frame[at] ^ 1 if frame[at - 1] != 0xAB else frame[at] ^ 0x02
    return frame[:at] + bytes((flipped,)) + frame[at + 1 :]


def written(script: Script, frames: list[Frame], *, interfaces: tuple[int, ...]) -> bytes:
    """Write a capture."""
    records = list(script.opening(START))
    for number, (to_robot, raw) in enumerate(frames, 1):
        records += (script.sent if to_robot else script.received)(START + number * STEP, raw)
    writer = PcapngWriter("test")
    return writer.start() + b"".join(map(writer.packet, records))


def by_us(file: bytes) -> list[Seen]:
    capture = open_capture(Source(io.BytesIO(file)), "a file")
    assert capture
    pairing = Pairing()
    return [ours(captured, pairing) for captured in capture.packets()]


def ours(captured: CapturedPacket, pairing: Pairing) -> Seen:
    """Return what our decoder found; a response of V1 has the ids of its command."""
    answered = pairing.feed(captured)
    after = answered.round_trip if answered else None
    generation = 2 if captured.generation is Generation.V2 else 1
    name = CODECS[captured.generation].code_name
    found: Packet = captured.packet
    raw = captured.raw
    match found:
        case Malformed(reason=reason):
            return Seen("malformed", reason=reason, raw=raw)
        case Request(command=command, seq=seq, source=source, flags=flags):
            did, cid, payload, target, _ = command
            return Seen(
                "command",
                generation,
                flags & 0xFF,
                target,
                source,
                did,
                cid,
                seq,
                payload=payload,
                checksum_ok=True,
            )
        case Response(seq=seq, code=code, payload=payload, did=did, cid=cid, source=source, target=target):
            flags = found.flags & 0xFF
            return Seen(
                "response",
                generation,
                flags,
                target,
                source,
                did,
                cid,
                seq,
                code,
                name(code),
                payload,
                True,
                None,
                after,
            )
        case Notification(did=did, cid=cid, payload=payload, source=source, target=target, seq=seq):
            flags = found.flags & 0xFF
            return Seen(
                "notification",
                generation,
                flags,
                target,
                source,
                did,
                cid,
                seq,
                payload=payload,
                checksum_ok=True,
            )


def by_tshark(file: bytes, folder: Path, *, passes: int = 2) -> list[Seen]:
    return [theirs(shown) for shown in shown_by_tshark(file, folder, passes=passes)]


def shown_by_tshark(file: bytes, folder: Path, *, passes: int = 2) -> list[ET.Element]:
    """Return the packets that Wireshark's engine shows with our script."""
    script, capture = folder / "sphero.lua", folder / "capture.pcapng"
    script.write_text(dissector("1.0"), encoding="utf-8")
    capture.write_bytes(file)
    command = (
        TSHARK or "",
        "-n",
        *(["-2"] if passes == 2 else []),
        "-X",
        f"lua_script:{script}",
        "-r",
        str(capture),
        "-T",
        "pdml",
    )
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "Lua" not in ran.stderr
    tree = ET.fromstring(ran.stdout)
    assert "Lua Error" not in ran.stdout
    return [shown for shown in tree.iter() if shown.get("name") == "sphero" and is_packet(shown)]


def is_packet(shown: ET.Element) -> bool:
    return any(field.get("name") == "sphero.kind" for field in shown)


def theirs(shown: ET.Element) -> Seen:
    fields = {field.get("name", "").removeprefix("sphero."): field for field in shown.iter("field")}

    def text(name: str) -> str | None:
        return fields[name].get("show") if name in fields else None

    def number(name: str) -> int | None:
        value = text(name)
        return None if value is None else int(value, 0)

    def octets(name: str) -> bytes:
        return bytes.fromhex((text(name) or "").replace(":", ""))

    flags = number("flags")
    after = text("time")
    return Seen(
        text("kind") or "",
        number("generation"),
        number("sop2") if flags is None else flags,
        number("target"),
        number("source"),
        number("did"),
        number("cid"),
        number("seq"),
        number("code"),
        text("code.name"),
        octets("payload"),
        None if (fits := text("checksum.ok")) is None else fits in ("1", "True"),
        text("malformed"),
        None if after is None else round(float(after) * 1e9),
        octets("frame") if text("malformed") else b"",
    )


def apart(seen: list[Seen]) -> tuple[list[Seen], list[Seen]]:
    """Return valid and damaged packets: our decoder keeps noise until more comes, the script shows it."""
    return [each for each in seen if not each.reason], [each for each in seen if each.reason]


@with_tshark
@pytest.mark.slow
@pytest.mark.parametrize("generation", Generation)
@pytest.mark.parametrize("serial", [False, True], ids=["ble", "serial"])
def test_tshark_shows_what_our_decoder_reads(generation: Generation, tmp_path: Path, *, serial: bool) -> None:
    script = SerialScript() if serial else BleScript(generation, "C0:00:00:00:00:01", "a robot")
    frames = [*made_up(generation, 150, 5), *golden(generation)]
    file = written(script, frames, interfaces=(script.link,))
    wanted = by_us(file)
    assert {seen.kind for seen in wanted} == {"command", "response", "notification", "malformed"}
    assert any(seen.answered_after for seen in wanted)
    assert apart(by_tshark(file, tmp_path)) == apart(wanted)


def payload_for(layout: Layout | None, rng: random.Random) -> bytes:
    """Return random bytes that fit a layout; letters where it has text, which is shown escaped otherwise."""
    if layout is None:
        return b""
    size = layout.minimum_length
    size += 8 if layout.accepts(size + 8) else 0
    return bytes(rng.choices(b"ABC", k=size)) if "cstring" in layout.text else rng.randbytes(size)


def every_layout(generation: Generation) -> Iterator[tuple[Frame, Layout, bytes]]:
    """Yield a command and a response for each row that is alone with its ids, and their payloads."""
    rng = random.Random(7)
    codec = CODECS[generation]
    for number, row in enumerate(row for row in all_rows(generation) if row.kind is Kind.COMMAND):
        if len(rows_of(generation, row.did, row.cid)) > 1:
            continue
        seq = number % 250
        asked, answer = (payload_for(layout, rng) for layout in (row.request, row.response))
        yield (
            (True, codec.encode_command(Command(row.did, row.cid, asked), seq)),
            row.request or Layout(""),
            asked,
        )
        did, cid = (None, None) if generation is Generation.V1 else (row.did, row.cid)
        response = Response(seq, 0, answer, did, cid, flags=1)
        yield (False, codec.encode_response(response)), row.response or Layout(""), answer


def is_shown(value: object, text: str) -> bool:
    match value:
        case bool():
            return text == str(value).lower()
        case int():
            return text == str(value)
        case float():
            return text == f"{value:.6g}" or float(text) == pytest.approx(value, rel=1e-5)
        case list():
            return all(str(word) in text for word in value if isinstance(word, str))
        case _:
            return text in (str(value), "-nan") or text.startswith(f"{value} (")


@with_tshark
@pytest.mark.slow
@pytest.mark.parametrize("generation", Generation)
def test_payload_fields_are_those_of_the_catalogue(generation: Generation, tmp_path: Path) -> None:
    script = BleScript(generation, "C0:00:00:00:00:01", "a robot")
    sent = list(every_layout(generation))
    file = written(script, [frame for frame, _, _ in sent], interfaces=(script.link,))
    shown = shown_by_tshark(file, tmp_path)
    assert len(shown) == len(sent)
    compared = 0
    for element, (_, layout, payload) in zip(shown, sent, strict=True):
        fields = [each.get("show", "") for each in element.iter("field") if each.get("name") == FIELD]
        decoded = layout.decode(payload)
        flags = {each.name for each in layout.fields if each.values and VALUE_NAMES[each.values].flags}
        wanted = [
            (name, one)
            for name, value in decoded.fields.items()
            for one in (value if isinstance(value, list) and name not in flags else [value])
            if one != ""
        ]
        if decoded.problem:
            continue
        assert [each.partition(": ")[0] for each in fields] == [name for name, _ in wanted], layout
        for text, (name, value) in zip(fields, wanted, strict=True):
            unit = decoded.units.get(name, "")
            assert text.endswith(unit)
            assert is_shown(value, text.partition(": ")[2].removesuffix(f" {unit}" if unit else "")), layout
            compared += 1
    assert compared > 50


@with_tshark
@pytest.mark.slow
def test_a_frame_in_several_values_is_shown_where_it_ends(tmp_path: Path) -> None:
    script = BleScript(Generation.V2, "C0:00:00:00:00:01", "a robot")
    answer = V2.encode_response(Response(7, 0, b"\x8d\x01\xd8", 0x13, 0x10, 0x11, flags=1))
    asked = V2.encode_command(Command(0x13, 0x10, b"", 0x11), 7)
    frames = [(True, asked), (False, answer[:5]), (False, answer[5:9]), (False, answer[9:] + answer)]
    file = written(script, frames, interfaces=(script.link,))
    seen = by_tshark(file, tmp_path)
    assert [each.kind for each in seen] == ["command", "response", "response"]
    assert seen == by_us(file)


def torn(frames: Iterator[Frame], rng: random.Random) -> Iterator[Frame]:
    """Yield frames in pieces; some bytes are wrong, missing or too many."""
    for to_robot, frame in frames:
        raw, chance = bytearray(frame), rng.random()
        if chance < 0.1:
            raw[rng.randrange(len(raw))] = rng.randrange(256)
        elif chance < 0.15:
            del raw[rng.randrange(1, len(raw)) :]
        elif chance < 0.2:
            raw[:0] = rng.randbytes(rng.randrange(1, 20))
        while raw:
            size = rng.choice((1, 2, 5, 20, 300))
            yield to_robot, bytes(raw[:size])
            del raw[:size]


@with_tshark
@pytest.mark.slow
@pytest.mark.parametrize("generation", Generation)
def test_damage_and_splits_lose_no_packet_and_invent_none(generation: Generation, tmp_path: Path) -> None:
    script = BleScript(generation, "C0:00:00:00:00:01", "a robot")
    rng = random.Random(1)
    file = written(script, list(torn(made_up(generation, 120, 1), rng)), interfaces=(script.link,))
    wanted, _ = apart(by_us(file))
    seen, noise = apart(by_tshark(file, tmp_path))
    assert noise
    # The end of the capture ends our decoder's wait for the rest of a V1 frame; Wireshark tells no end.
    assert len(seen) > len(wanted) - 5
    assert seen == wanted[: len(seen)]


@with_tshark
@pytest.mark.slow
def test_robots_stay_apart_and_other_devices_show_nothing(tmp_path: Path) -> None:
    file = pcapng(as_raw(hci(woven(found_v2(), found_v1(), found_v1(), foreign())), 201))
    capture = open_capture(Source(io.BytesIO(file)), "a file")
    assert capture
    scripts: dict[int, BleScript] = {}
    records: list[Record] = []
    for captured in capture.packets():
        number, peer, name = captured.connection
        time = captured.time or 0
        if number not in scripts:
            scripts[number] = BleScript(captured.generation, peer or "", name or "", number)
            records += scripts[number].opening(time)
        records += (scripts[number].sent if captured.to_robot else scripts[number].received)(
            time, captured.raw
        )
    writer = PcapngWriter("test")
    alone = writer.start() + b"".join(map(writer.packet, records))
    pairings = {number: Pairing() for number in scripts}
    again = open_capture(Source(io.BytesIO(alone)), "a file")
    assert again
    wanted = [ours(captured, pairings[captured.connection.number]) for captured in again.packets()]
    assert len(scripts) == 3
    assert sorted(by_tshark(alone, tmp_path), key=repr) == sorted(wanted, key=repr)
    assert by_tshark(pcapng(as_raw(hci(woven(foreign())), 201)), tmp_path) == []


@with_tshark
@pytest.mark.slow
def test_another_serial_line_shows_nothing(tmp_path: Path) -> None:
    frames = [(number % 2 == 0, bytes((0xFF, 0xFF, number, 0x8D, number))) for number in range(30)]
    script = SerialScript()
    assert by_tshark(written(script, frames, interfaces=(script.link,)), tmp_path) == []


@with_tshark
@pytest.mark.slow
@pytest.mark.parametrize("bare", [False, True], ids=["250", "147"])
def test_serial_lines_of_one_file_stay_apart(tmp_path: Path, *, bare: bool) -> None:
    writer = PcapngWriter("test")
    records: list[Record] = []
    for line, generation in enumerate(Generation):
        script = SerialScript(line)
        for number, (to_robot, raw) in enumerate(made_up(generation, 40, line)):
            cut = 5 if number > 3 else len(raw)  # the first frames are whole, and tell the protocol
            for at, piece in enumerate((raw[:cut], raw[cut:])):
                when = START + (2 * number + at) * STEP
                records += (script.sent if to_robot else script.received)(when, piece)
    if bare:
        records = [record._replace(link=USER_SERIAL, data=record.data[12:]) for record in records]
    records.sort(key=lambda record: record.time or 0)
    whole = [record for record in records if record.data]
    file = writer.start() + b"".join(map(writer.packet, whole))
    wanted, found = apart(by_us(file))[0], apart(by_tshark(file, tmp_path, passes=1))[0]
    assert {seen.generation for seen in wanted} == {1, 2}
    assert sorted(found, key=repr) == sorted(wanted, key=repr)
