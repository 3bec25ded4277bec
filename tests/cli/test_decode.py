"""``decode`` takes streams of any length in pieces of any size: nothing is kept but what is not told yet."""

import gc
import io
import json
import os
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.cli import hex_stream
from sphero_probe.cli.actions import decode
from sphero_probe.cli.parse import hex_bytes
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.protocol.packets import Notification, Response
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v2 import V2
from tests.support.cli import Cli

FRAMES = [
    V2.encode_response(Response(number, 0, bytes([0x8D, number]), 0x13, 0x10, 0x12, 0x01, 0x39))
    for number in range(5)
]
STREAM = b"".join(FRAMES)


def as_0x(data: bytes) -> str:
    return ", ".join(f"0x{byte:02x}" for byte in data)


SPELLINGS: dict[str, Callable[[bytes], str]] = {
    "solid": bytes.hex,
    "blanks": lambda data: data.hex(" "),
    "colons": lambda data: data.hex(":").upper(),
    "0x": as_0x,
    "lines": lambda data: "\r\n".join(data.hex("_")[at : at + 6] for at in range(0, len(data) * 3, 6)) + "\n",
}


def unhexed(text: bytes, size: int) -> bytes:
    pieces = (text[at : at + size] for at in range(0, len(text), size))
    return b"".join(hex_stream.unhexed(pieces, "a file"))


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize("size", [1, 2, 3, 5, 64, 10_000])
def test_hex_text_is_read_wherever_it_is_cut(spelling: str, size: int) -> None:
    text = SPELLINGS[spelling](STREAM).encode()
    assert unhexed(text, size) == STREAM


ONE_DIGIT = [
    pytest.param(b"0x1 0x2", "0102", id="prefixed"),
    pytest.param(b"0x7 0xf 0x0 0x0", "070f0000", id="prefixed, four"),
    pytest.param(b"1 2", "0102", id="bare"),
    pytest.param(b"1:2,3_4", "01020304", id="other separators"),
    pytest.param(b"0x1\n0x2\n", "0102", id="prefixed, a line each"),
    pytest.param(b"1\n0x2 3\n44", "01020344", id="at the ends of lines"),
    pytest.param(b"0", "00", id="half a prefix"),
    pytest.param(b"0x8D 0xa 0X13 0x0102", "8d0a130102", id="mixed lengths"),
    pytest.param(b"1 \n\n", "01", id="blank lines after a digit"),
    pytest.param(b"ff" + b" " * 63 + b"1", "ff01", id="a token at the end of the gap"),
    pytest.param(b"1\n" + b"8d" * 40, "01" + "8d" * 40, id="a digit before a long token"),
]


@pytest.mark.parametrize(("text", "expected"), ONE_DIGIT)
@pytest.mark.parametrize("size", [1, 2, 3, 4, 100])
def test_a_token_of_one_digit_is_a_byte(text: bytes, expected: str, size: int) -> None:
    assert unhexed(text, size).hex() == expected
    assert hex_bytes(text.decode(), "text").hex() == expected


@given(
    st.lists(st.sampled_from(["1", "0", "8d", "0x1", "0xa", "0X8d", "0102", " ", ",", ":", "x"]), max_size=9)
)
def test_a_stream_says_what_the_argument_says(parts: list[str]) -> None:
    text = "".join(parts)
    try:
        expected = hex_bytes(text, "text")
    except UsageError:
        for size in (1, 2, 100):
            with pytest.raises(BadInputFileError):
                unhexed(text.encode(), size)
        return
    for size in (1, 2, 100):
        assert unhexed(text.encode(), size) == expected


@given(st.binary(max_size=40), st.sampled_from(sorted(SPELLINGS)), st.integers(1, 9))
def test_any_bytes_come_through_as_hex_text(data: bytes, spelling: str, size: int) -> None:
    assert unhexed(SPELLINGS[spelling](data).encode(), size) == data


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(b"8d0a13zz", "byte 0x7a at offset 6", id="a letter"),
        pytest.param(b"8d0a\n13 \xff", "byte 0xff at offset 8", id="no text"),
        pytest.param(b"0x8d x8d", "byte 0x78 at offset 5", id="half a prefix"),
        pytest.param(b"8d0xx8", "byte 0x78 at offset 3", id="a prefix inside a token"),
        pytest.param(b"8d 0xx8", "byte 0x78 at offset 5", id="two x"),
        pytest.param(b"8d 0x, 0a", "byte 0x78 at offset 4", id="a prefix alone"),
        pytest.param(b"8d 0x", "byte 0x78 at offset 4", id="a prefix at the end"),
        pytest.param(b"8d 0a1", "'0a1' has an odd number of hex digits at offset 3", id="odd at the end"),
        pytest.param(b"8d 0x0a1 13", "an odd number of hex digits at offset 5", id="odd, with a prefix"),
        pytest.param(b"8d0a130 ", "an odd number of hex digits", id="odd, longer than a piece"),
        pytest.param(b"8d 0a 1\n3 10", "cut the byte '13' at offset 6", id="a byte cut by a line break"),
        pytest.param(b"8d 0a 1,\r\n 3", "cut the byte '13' at offset 6", id="cut, with blanks"),
    ],
)
@pytest.mark.parametrize("size", [1, 2, 3, 4, 100])
def test_hex_text_that_is_none(text: bytes, message: str, size: int) -> None:
    with pytest.raises(BadInputFileError, match=message):
        unhexed(text, size)


@pytest.mark.parametrize("name", ["jsonl", "plain", "json"])
def test_what_came_before_wrong_hex_is_told(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(hex_stream, "CHUNK", 16)
    file = tmp_path / "stream.txt"
    file.write_text(f"{STREAM.hex(' ')} oops")
    ran = cli("decode", str(file), "--format", name)
    assert ran.code == 8
    assert f"byte 0x6f at offset {3 * len(STREAM)}" in ran.err
    assert ran.out.count("power.get_battery_percentage") == len(FRAMES)
    if name == "json":
        assert len(json.loads(ran.out)) == len(FRAMES)


@pytest.mark.parametrize("size", [1, 3, 10, 1 << 14])
@pytest.mark.parametrize("spelling", ["binary", *SPELLINGS])
def test_a_file_says_the_same_whatever_its_spelling(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spelling: str, size: int
) -> None:
    monkeypatch.setattr(hex_stream, "CHUNK", size)
    file = tmp_path / "stream"
    file.write_bytes(STREAM if spelling == "binary" else SPELLINGS[spelling](STREAM).encode())
    rows = [json.loads(line) for line in cli("decode", str(file), "--format", "jsonl").out.splitlines()]
    assert [row["raw"] for row in rows] == [frame.hex() for frame in FRAMES]


@pytest.mark.parametrize("name", ["jsonl", "plain", "json"])
def test_packets_are_told_before_the_next_bytes_are_read(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    lines_told: list[int] = []

    class Slow(io.BytesIO):
        def read1(self, size: int | None = -1) -> bytes:
            assert size is not None
            stdout: Any = sys.stdout
            lines_told.append(stdout.getvalue().count("power.get_battery_percentage"))
            return super().read1(min(size, len(FRAMES[0])))

    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=Slow(STREAM), isatty=lambda: False))
    assert cli("decode", "-", "--format", name).code == 0
    assert lines_told == [0, 1, 2, 3, 4, 5]


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("spelling", "name"),
    [("binary", "jsonl"), ("hex", "jsonl"), ("noise", "jsonl"), ("binary", "json"), ("noise", "table")],
)
def test_a_long_stream_needs_no_more_memory_than_a_short_one(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spelling: str, name: str
) -> None:
    monkeypatch.setattr(decode, "_TABLE_ROOM", 5000)
    block = b"".join(
        V2.encode_notification(Notification(0x1B, number, bytes(900), 1, None, 0xFF, 8))
        for number in range(20)
    )
    block = bytes(20_000) + FRAMES[0] if spelling == "noise" else block
    peaks = []
    for repeats in (2, 8, 30):  # the first warms up
        file = tmp_path / f"{repeats}.bin"
        file.write_bytes((block * repeats).hex().encode() if spelling == "hex" else block * repeats)
        gc.collect()
        tracemalloc.start()
        assert cli("decode", str(file), "--format", name, "-o", os.devnull).code == 0
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < peaks[1] + 200_000, peaks
    assert peaks[2] < 4_000_000


def test_a_table_shows_what_it_can_hold_and_says_how_many_it_does_not(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decode, "_TABLE_ROOM", 3 * (len(FRAMES[0]) + 32) + 1)
    file = tmp_path / "stream.bin"
    file.write_bytes(STREAM)
    ran = cli("decode", str(file), "--format", "table")
    assert ran.out.count("get_battery_percentage") == 3
    assert ran.err == "Not shown: 2 more packets; --format plain or jsonl shows all.\n"
    file.write_bytes(b"".join(FRAMES[:3]))
    assert "Not shown" not in cli("decode", str(file), "--format", "table").err
    assert "Not shown" not in cli("decode", str(file), str(file), "--format", "plain").err


def test_both_generations_in_one_file_cut_anywhere(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ping = V1.encode_response(Response(3, 0))
    file = tmp_path / "both.bin"
    file.write_bytes(FRAMES[0] + ping + b"u>" + FRAMES[1] + ping)
    outs = []
    for size in (1, 5, 1 << 14):
        monkeypatch.setattr(hex_stream, "CHUNK", size)
        outs.append(cli("decode", str(file), "--format", "jsonl").out)
    kinds = [(row["generation"], row["kind"]) for row in map(json.loads, outs[0].splitlines())]
    assert kinds[:3] == [("v2", "response"), ("v1", "response"), ("v1", "malformed")]
    assert kinds[3:] == [("v2", "response"), ("v1", "response")]
    assert len(set(outs)) == 1


def test_an_empty_file_holds_no_packet(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "empty"
    file.touch()
    ran = cli("decode", str(file))
    assert (ran.code, ran.out) == (8, "")
    assert "no packet in 0 bytes" in ran.err
