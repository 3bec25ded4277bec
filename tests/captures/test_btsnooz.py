"""Android's compressed log in the text of a bug report gives what the whole log gives."""

import struct
import zlib
from base64 import b64encode
from contextlib import suppress
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.captures.btsnooz import as_btsnoop, btsnooz_in
from sphero_probe.errors import UnreadableCaptureError
from tests.support import capture_writers as writers
from tests.support.capture_conversation import START
from tests.support.captures import TALK
from tests.support.cli import Cli

KINDS = {
    (writers.COMMAND, True): 0x20,
    (writers.EVENT, False): 0x10,
    (writers.ACL, True): 0x21,
    (writers.ACL, False): 0x11,
}
HCI = sorted(writers.hci(TALK), key=lambda packet: packet.time)


def btsnooz(version: int = 2, most: int = 1 << 16) -> bytes:
    """Write the conversation as Android does: the time of the last packet in front, then differences."""
    records, last = b"", START - 20_000
    for packet in HCI:
        kept = packet.data[:most] if packet.kind == writers.ACL else packet.data
        after, last = packet.time - last, packet.time
        sizes = (len(kept) + 1,) if version == 1 else (len(kept) + 1, len(packet.data) + 1)
        records += struct.pack("<" + "H" * len(sizes) + "IB", *sizes, after, KINDS[packet.kind, packet.sent])
        records += kept
    return struct.pack("<BQ", version, last) + zlib.compress(records)


def report(log: bytes) -> bytes:
    """The text of a bug report around a log."""
    text = b64encode(log)
    lines = b"\n".join(text[at : at + 128] for at in range(0, len(text), 128))
    head = b"========================================================\n== dumpstate: 2023-11-14 22:13:20\n"
    begin = b"--- BEGIN:BTSNOOP_LOG_SUMMARY (%d bytes in) ---\n" % len(log)
    return (
        head
        + "Bluetooth Status\n  name: Ana\u2019s phone\n".encode()
        + begin
        + lines
        + (b"\n--- END:BTSNOOP_LOG_SUMMARY ---\nmore\n")
    )


def test_a_log_is_the_btsnoop_file_of_the_same_packets() -> None:
    whole = writers.btsnoop(HCI)
    for version in (1, 2):
        log = btsnooz_in(report(btsnooz(version)).splitlines(keepends=True))
        assert log is not None
        assert as_btsnoop(log) == whole


@pytest.mark.parametrize("version", [1, 2])
def test_every_way_to_give_a_bug_report_is_read(cli: Cli, tmp_path: Path, version: int) -> None:
    plain = tmp_path / "btsnoop_hci.log"
    plain.write_bytes(writers.btsnoop(HCI))
    expected = cli("decode", str(plain), "--format", "jsonl").out
    log = btsnooz(version)
    text, raw, zipped, other = (tmp_path / name for name in ("report.txt", "raw", "a.zip", "b.zip"))
    text.write_bytes(report(log))
    raw.write_bytes(log)
    with ZipFile(zipped, "w", ZIP_DEFLATED) as archive:
        archive.writestr("version.txt", "2.0")
        archive.writestr("bugreport-phone-2023.txt", report(log))
    with ZipFile(other, "w", ZIP_DEFLATED) as archive:
        archive.writestr("FS/data/misc/bluetooth/logs/btsnooz_hci.log", log)
    for path in (text, raw, zipped, other):
        ran = cli("decode", str(path), "--format", "jsonl")
        assert ran.code == 0, ran.err
        assert ran.out == expected
        assert cli("capture", "show", str(path), "--summary").code == 0


def test_packets_that_android_cut_are_counted_and_not_used(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "report.txt"
    path.write_bytes(report(btsnooz(most=14)))
    ran = cli("decode", str(path), "--format", "jsonl")
    assert ran.code == 0
    assert "ACL packets cut short" in ran.err
    assert "HCI snoop log" in ran.err


def test_a_text_without_a_log_is_none() -> None:
    assert btsnooz_in([b"nothing\n", b"here\n"]) is None


@pytest.mark.parametrize("log", [b"", b"\x03" + bytes(20), b"\x02" + bytes(20)])
def test_what_is_no_log_is_an_error(log: bytes) -> None:
    with pytest.raises(UnreadableCaptureError, match="a btsnooz log"):
        as_btsnoop(log)


@given(st.floats(0, 1), st.integers(0, 20), st.binary(max_size=8), st.sampled_from([1, 2]))
def test_a_damaged_log_is_read_as_far_as_it_goes(
    at: float, removed: int, put_in: bytes, version: int
) -> None:
    text = report(btsnooz(version))
    place = int(at * len(text))
    damaged = text[:place] + put_in + text[place + removed :]
    with suppress(UnreadableCaptureError):
        log = btsnooz_in(damaged.splitlines(keepends=True))
        assert log is None or as_btsnoop(log).startswith(b"btsnoop\0")


def test_a_cut_log_gives_its_first_packets() -> None:
    log = btsnooz()
    whole, part = as_btsnoop(log), as_btsnoop(log[: len(log) // 2])
    sizes = [len(one) for one in (part, whole)]
    assert 1000 < sizes[0] < sizes[1]
