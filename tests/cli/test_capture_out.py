"""``--capture`` writes every frame as it happens, in a file that Wireshark and this tool read."""

import io
import shutil
import subprocess
from pathlib import Path

import pytest

from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.pcapng_out import head, packet
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
    blocks = [head("a test", script.link), *map(packet, script.opening(START * 1000))]
    for number, frame in enumerate(frames):
        say = script.received if number else script.sent
        blocks += [packet(record) for record in say(START * 1000 + number, frame)]
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


def test_convert_says_what_it_cannot_do(cli: Cli, tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(CAPTURES["pcap 201"]())
    assert cli("capture", "convert", str(source), "-o", str(tmp_path / "none" / "made")).code == 10
    assert cli("capture", "convert", str(source), "-o", str(source)).code == 2
    assert cli("capture", "convert", str(source)).code == 2
