"""``--capture`` writes every frame as it happens, in a file that Wireshark and this tool read."""

import io
import json
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.pcapng_out import PcapngWriter
from sphero_probe.captures.reader import open_capture
from sphero_probe.captures.source import Source
from sphero_probe.captures.synthetic import BleScript, Script, SerialScript
from sphero_probe.protocol.packets import Generation, Malformed
from tests.support.capture_conversation import LONG, START, V1_FRAMES, V2_FRAMES
from tests.support.captures import CAPTURES
from tests.support.cli import Cli, objects

TSHARK = shutil.which("tshark")


def packets(file: bytes) -> list[CapturedPacket]:
    capture = open_capture(Source(io.BytesIO(file)), "a file")
    assert capture
    return list(capture.packets())


@pytest.mark.parametrize("robot", ["bolt-plus", "mini", "bb8"])
def test_a_sweep_is_captured_frame_by_frame(cli: Cli, tmp_path: Path, robot: str) -> None:
    path = tmp_path / "out.pcapng"
    did = "0x13" if robot != "bb8" else "0x00"
    ran = cli("sweep", "--did", did, "--device", f"fake:{robot}", "--capture", str(path), "--format", "jsonl")
    assert ran.code == 0, ran.err
    read = packets(path.read_bytes())
    sent = {packet.raw.hex() for packet in read if packet.to_robot}
    received = {packet.raw.hex() for packet in read if packet.to_robot is False}
    findings = [row for row in objects(ran.out) if row["type"] == "finding" and row["sent"]]
    assert len(findings) > 100
    assert {row["sent"] for row in findings} <= sent
    assert {row["received"] for row in findings if row["received"]} <= received
    assert not any(isinstance(packet.packet, Malformed) for packet in read)
    times = [packet.time or 0 for packet in read]
    assert times == sorted(times)
    assert read[0].connection.name == f"fake:{robot}"


SCRIPTS: dict[str, tuple[Script, list[bytes]]] = {
    "v2": (BleScript(Generation.V2, "C0:11:22:33:44:55", "BP-0001"), [*V2_FRAMES[:2], LONG * 5]),
    "v1": (BleScript(Generation.V1, "C0:11:22:33:44:55", "BB-0001"), V1_FRAMES[:2]),
    "serial": (SerialScript(), V2_FRAMES[:2]),
}


def written(script: Script, frames: list[bytes]) -> list[bytes]:
    writer = PcapngWriter("a test")
    blocks = [writer.start(), *map(writer.packet, script.opening(START * 1000))]
    for number, frame in enumerate(frames):
        say = script.received if number else script.sent
        blocks += [writer.packet(record) for record in say(START * 1000 + number, frame)]
    return blocks


@pytest.mark.parametrize("kind", SCRIPTS)
def test_what_is_written_is_read_back(kind: str) -> None:
    script, frames = SCRIPTS[kind]
    read = packets(b"".join(written(script, frames)))
    assert b"".join(packet.raw for packet in read) == b"".join(frames)
    assert [packet.to_robot for packet in read][:2] == [True, False]
    if kind != "serial":
        assert {packet.connection.peer for packet in read} == {"C0:11:22:33:44:55"}
        assert read[0].time == START * 1000


@pytest.mark.parametrize("kind", SCRIPTS)
def test_a_file_that_ends_after_any_block_is_whole(kind: str) -> None:
    blocks = written(*SCRIPTS[kind])
    for end in range(1, len(blocks)):
        capture = open_capture(Source(io.BytesIO(b"".join(blocks[:end]))), "a file")
        assert capture
        list(capture.packets())
        assert capture.cut is None


@pytest.mark.unmeasured
@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
@pytest.mark.parametrize("kind", ["v1", "v2"])
def test_tshark_shows_the_values_and_their_characteristics(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "out.pcapng"
    script, frames = SCRIPTS[kind]
    path.write_bytes(b"".join(written(script, frames)))
    shown = ("-T", "fields", "-e", "btatt.opcode", "-e", "btatt.value", "-e", "_ws.malformed")
    command = (TSHARK or "", "-n", "-r", str(path), "-Y", "btatt", *shown)
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = [line.split("\t") for line in ran.stdout.splitlines()]
    assert not any(row[2] for row in rows)
    values = [row[1] for row in rows if row[0] in {"0x52", "0x1b"}]
    assert bytes.fromhex("".join(values)) == b"".join(frames)
    assert {"0x02", "0x10", "0x08"} <= {row[0] for row in rows}


def comments(file: bytes) -> list[list[str]]:
    """The comments of each packet block and the text of each journal entry, read by the specification."""
    found: list[list[str]] = []
    at = 0
    while at < len(file):
        kind, size = struct.unpack_from("<II", file, at)
        if kind == 9:
            found.append([file[at + 8 : at + size - 4].decode().split("MESSAGE=")[1].split("\n")[0]])
        if kind == 6:
            (length,) = struct.unpack_from("<I", file, at + 20)
            option, said = at + 28 + length + -length % 4, []
            while option < at + size - 4:
                code, count = struct.unpack_from("<HH", file, option)
                said += [file[option + 4 : option + 4 + count].decode()] if code == 1 else []
                option += 4 + count + -count % 4
            found.append(said)
        at += size
    return found


def by_probe(file: bytes) -> dict[int, list[str]]:
    """Number of a probe -> what the comments say of it, in order."""
    said: dict[int, list[str]] = {}
    for text in (text for texts in comments(file) for text in texts):
        probe, _, rest = text.partition(": ")
        said.setdefault(int(probe.removeprefix("probe ")), []).append(rest)
    return said


def answers_in(journal: Path) -> list[str]:
    """The answers of a journal, in the order in which they were written; the last of each probe counts."""
    last: dict[int, str] = {}
    for entry in map(json.loads, journal.read_text().splitlines()):
        if entry["type"] == "finding":
            last.pop(entry["number"], None)
            last[entry["number"]] = entry.get("received") or ""
    return [answer for answer in last.values() if answer]


ASKED = ("sweep", "--did", "0x13", "--cid", "0x03-0x12", "--format", "jsonl", "--device")


def test_comments_tell_number_and_verdict_of_each_probe(cli: Cli, tmp_path: Path) -> None:
    live, later, journal = (tmp_path / name for name in ("live.pcapng", "later.pcapng", "run.jsonl"))
    asked = (*ASKED, "fake:bolt-plus?silent=0x13:0x07", "--allow", "persist")
    ran = cli(*asked, "--capture", str(live), "--journal", str(journal))
    assert ran.code == 0, ran.err
    findings = [row for row in objects(ran.out) if row["type"] == "finding" and row["attempts"]]
    outcomes = {row["number"]: row["outcome"] for row in findings}
    assert {"exists", "absent", "silent"} <= set(outcomes.values())
    assert cli("capture", "convert", str(journal), "--to", "pcapng", "-o", str(later)).code == 0
    for path in (live, later):
        said = by_probe(path.read_bytes())
        assert set(said) == set(outcomes)
        for number, outcome in outcomes.items():
            assert said[number][0].startswith("0x13:0x")
            assert said[number][-1].startswith(outcome)
    answers = [at.raw.hex() for at in packets(later.read_bytes()) if at.to_robot is False]
    assert sorted(row["received"] for row in findings if row["received"]) == sorted(answers)
    assert answers == answers_in(journal)


def test_the_comment_of_an_answer_is_on_the_answer(cli: Cli, tmp_path: Path) -> None:
    live = tmp_path / "live.pcapng"
    assert cli(*ASKED, "fake:bolt-plus", "--capture", str(live)).code == 0
    file = live.read_bytes()
    capture = open_capture(Source(io.BytesIO(file)), "a file")
    assert capture
    att = list(capture.att_packets())
    said = comments(file)[-len(att) :]
    verdicts = [
        packet.data[0] for packet, texts in zip(att, said, strict=True) if "exists" in " ".join(texts)
    ]
    assert len(verdicts) >= 3
    assert set(verdicts) == {0x1B}


@pytest.mark.slow
@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
def test_tshark_shows_the_comments(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "live.pcapng"
    asked = (*ASKED, "fake:bolt-plus?silent=0x13:0x07", "--allow", "persist", "--capture", str(path))
    assert cli(*asked).code == 0
    shown = ("-T", "fields", "-e", "frame.comment", "-e", "systemd_journal.message")
    command = (TSHARK or "", "-n", "-r", str(path), *shown)
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    expected = [text for texts in comments(path.read_bytes()) if texts for text in [",".join(texts)]]
    assert [line.strip() for line in ran.stdout.splitlines() if line.strip()] == expected
    assert any("silent" in text for text in expected)


def test_a_run_that_sent_nothing_leaves_a_file_without_packets_and_says_so(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "none.pcapng"
    ran = cli("send", "power.sleep", "--device", "fake:bolt-plus", "--capture", str(path))
    assert f"{path} has no packets" in ran.err
    assert packets(path.read_bytes()) == []


def test_a_run_on_a_serial_line_is_converted_to_one(cli: Cli, tmp_path: Path) -> None:
    journal, made = tmp_path / "run.jsonl", tmp_path / "made.pcapng"
    assert cli(*ASKED, "fake:rvr", "--journal", str(journal)).code == 0
    journal.write_text(journal.read_text().replace('"address":"fake:rvr"', '"address":"serial:/dev/ttyS0"'))
    assert cli("capture", "convert", str(journal), "-o", str(made)).code == 0
    read = packets(made.read_bytes())
    assert read
    assert all(at.handle is None for at in read)


def test_a_file_that_cannot_be_written_is_an_error(cli: Cli, tmp_path: Path) -> None:
    ran = cli("info", "--device", "fake:bolt-plus", "--capture", str(tmp_path / "none" / "out.pcapng"))
    assert ran.code == 10
    assert "cannot write" in ran.err
    assert cli("doctor", "--capture", "x").code == 2


def test_convert_keeps_the_robots_and_nothing_else(cli: Cli, tmp_path: Path) -> None:
    source, made = tmp_path / "source", tmp_path / "made.pcapng"
    source.write_bytes(CAPTURES["pcap 256"]())
    ran = cli("capture", "convert", str(source), "-o", str(made))
    assert ran.code == 0, ran.err
    before, after = packets(source.read_bytes()), packets(made.read_bytes())

    def facts(read: list[CapturedPacket]) -> list[tuple[object, ...]]:
        return [
            (each.raw, each.to_robot, each.time, each.connection.name, each.connection.peer) for each in read
        ]

    assert facts(after) == facts(before)
    assert len(after) == 20
    capture = open_capture(Source(io.BytesIO(made.read_bytes())), "made")
    assert capture
    assert not [att for att in capture.att_packets() if att.data[:1] == b"\x1b" and att.data[1] == 0x31]


def test_convert_of_a_serial_line(cli: Cli, tmp_path: Path) -> None:
    source, made = tmp_path / "source", tmp_path / "made.pcapng"
    source.write_bytes(b"".join(written(SerialScript(), V2_FRAMES[:2])))
    assert cli("capture", "convert", str(source), "-o", str(made)).code == 0
    assert [packet.raw for packet in packets(made.read_bytes())] == V2_FRAMES[:2]


def test_serial_lines_stay_apart(cli: Cli, tmp_path: Path) -> None:
    source, made = tmp_path / "source", tmp_path / "made.pcapng"
    writer = PcapngWriter("a test")
    blocks = [writer.start()]
    for at in range(12):
        for line, frames in enumerate((V2_FRAMES[:2], V1_FRAMES[:2])):
            way = SerialScript(line).received if at else SerialScript(line).sent
            piece = frames[1][2 * at - 2 : 2 * at] if at else frames[0]
            blocks += [writer.packet(record) for record in way(START, piece)]
    source.write_bytes(b"".join(blocks))
    assert cli("capture", "convert", str(source), "-o", str(made)).code == 0
    before, after = packets(source.read_bytes()), packets(made.read_bytes())
    assert [(at.connection.number, at.raw) for at in before] == [
        (at.connection.number, at.raw) for at in after
    ]
    assert {at.connection.number for at in after} == {1, 2}


def test_convert_says_what_it_cannot_do(cli: Cli, tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(CAPTURES["pcap 201"]())
    assert cli("capture", "convert", str(source), "-o", str(tmp_path / "none" / "made")).code == 10
    assert cli("capture", "convert", str(source), "-o", str(source)).code == 2
    assert cli("capture", "convert", str(source)).code == 2
    none = cli("capture", "convert", str(tmp_path / "none"), "-o", str(tmp_path / "made"))
    assert none.code == 8
    assert "no such file or run" in none.err
