"""tshark, an independent reader, finds the same ATT packets in the same files."""

import io
import shutil
import subprocess
from pathlib import Path

import pytest

from sphero_probe.captures.reader import open_capture
from sphero_probe.captures.source import Source
from tests.support.capture_radio import radio
from tests.support.capture_writers import pcap, pcapng
from tests.support.captures import CAPTURES, TALK

TSHARK = shutil.which("tshark")
WITH_VALUE = {0x12, 0x52, 0x1B, 0x1D}

pytestmark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")

Said = tuple[int, int | None, str | None]
"""Opcode, handle and value; the last two for the packets that carry one value."""


def by_tshark(path: Path) -> list[Said]:
    fields = ("-e", "btatt.opcode", "-e", "btatt.handle", "-e", "btatt.value")
    command = (
        TSHARK or "",
        "-n",
        "-r",
        str(path),
        "-Y",
        "btatt && !btle.retransmit",
        "-T",
        "fields",
        *fields,
    )
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    said: list[Said] = []
    for line in ran.stdout.splitlines():
        opcode, handle, value = line.split("\t")
        code = int(opcode, 16)
        one = code in WITH_VALUE
        said.append((code, int(handle.split(",")[0], 16) if one else None, value if one else None))
    return said


def by_us(path: Path) -> list[Said]:
    capture = open_capture(Source(io.BytesIO(path.read_bytes())), "a file")
    assert capture
    said: list[Said] = []
    for packet in capture.att_packets():
        data = packet.data
        one = data[0] in WITH_VALUE
        handle = int.from_bytes(data[1:3], "little")
        said.append((data[0], handle if one else None, data[3:].hex() if one else None))
    return said


ON_AIR = {
    "pcap 251": lambda: pcap(radio(TALK, 251, damaged=False, repeated=False)),
    "pcapng 256": lambda: pcapng(radio(TALK, 256, damaged=False)),
    "pcapng 272": lambda: pcapng(radio(TALK, 272, damaged=False, repeated=False)),
}
"""Without what tshark reads otherwise: for it, what follows a damaged packet is that packet sent
again, and only link type 256 tells what is sent again."""
JUDGED = {
    kind: make for kind, make in CAPTURES.items() if not any(link in kind for link in ("251", "256", "272"))
}
JUDGED |= ON_AIR


@pytest.mark.slow
@pytest.mark.parametrize("kind", JUDGED)
def test_tshark_reads_the_same_att_packets(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "capture"
    path.write_bytes(JUDGED[kind]())
    assert by_us(path) == by_tshark(path)
