"""``decode`` takes what people paste, in arguments, files and standard input alike."""

import io
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.captures.test_text import FORMS, LOGS, XXD
from tests.support.capture_conversation import V1_FRAMES, V2_FRAMES
from tests.support.cli import Cli, objects

TWELVE = [*V2_FRAMES, *V1_FRAMES[:2]]


def raws(out: str) -> list[str]:
    return [row["raw"] for row in objects(out)]


@pytest.mark.parametrize("form", FORMS)
def test_twelve_frames_are_twelve_packets(
    cli: Cli, form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = [frame.hex() for frame in TWELVE]
    lines = [FORMS[form](frame) for frame in TWELVE]
    path = tmp_path / "pasted.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    from_file = cli("decode", str(path), "--format", "jsonl")
    assert raws(from_file.out) == expected, from_file.err
    monkeypatch.setattr(
        sys, "stdin", SimpleNamespace(buffer=io.BytesIO(path.read_bytes()), isatty=lambda: False)
    )
    assert raws(cli("decode", "-", "--format", "jsonl").out) == expected
    from_arguments = cli("decode", "--format", "jsonl", "--", *lines)
    assert sorted(raws(from_arguments.out)) == sorted(expected), from_arguments.err


PUBLIC_REPORTS = """\
I believe is the correct packet for wake ([0x8d, 0x3e, 0x11, 0x01, 0x13, 0x0d, 0x00, 0x8f, 0xd8])
Wakeup: 8D,18,00,13,0D,01,C6,D8
Sleep: 8D,18,01,13,01,01,D1,D8
OBX:+[RKResponseFactory responseFromRawPacket:withCommand:] - Command Packet: <ffff0104 0001f9>
OBX:+[RKResponseFactory responseFromRawPacket:withCommand:] - Error Response 0x09
2014/07/25 15:53:36 Sphero Changing Direction 109
GetRGB is [255 255 0 169 4 4 229 215 146]
SetRGB is 63 137 234
PowerState is [255 255 0 176 9 1 2 3 6 0 42 10 47 215]
2014/07/25 15:53:46 Sphero Changing Direction 28
GetRGB is [255 255 0 172 1 82]
PowerState is [255 255 0 177 1 77]
GetRGB is [255 255 0 177 4 63 137 234 152]
PowerState is [255 255 0 184 9 1 2 3 5 0 42 10 67 188]
GetRGB is [255 255 0 180 1 74]
GetRGB is []
    const wake = [0x8d, 0x3e, 0x11, 0x01, 0x13, 0x0d, 0x00, 0x8f, 0xd8];
"""
"""The bytes as people pasted them, with lines between them that hold no packet [community.sphero.com/t/1401;
github.com/sphero-inc/Sphero-iOS-SDK/issues/52; github.com/hybridgroup/gobot/issues/84]."""
IN_PUBLIC_REPORTS = [
    "8d3e1101130d008fd8",
    "8d1800130d01c6d8",
    "8d1801130101d1d8",
    "ffff01040001f9",
    "ffff00a90404e5d792",
    "ffff00b00901020306002a0a2fd7",
    "ffff00ac0152",
    "ffff00b1014d",
    "ffff00b1043f89ea98",
    "ffff00b80901020305002a0a43bc",
    "ffff00b4014a",
    "8d3e1101130d008fd8",
]


def test_twelve_frames_of_public_reports_are_twelve_packets(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "reports.txt"
    path.write_text(PUBLIC_REPORTS, encoding="utf-8")
    ran = cli("decode", str(path), "--format", "jsonl")
    assert raws(ran.out) == IN_PUBLIC_REPORTS
    assert not any(row["kind"] == "malformed" for row in objects(ran.out))
    assert ran.err == ""


def test_a_log_shows_time_and_direction(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "nrf.txt"
    path.write_text(LOGS["nRF Connect, Android"], encoding="utf-8")
    rows = objects(cli("decode", str(path), "--format", "jsonl").out)
    assert [(row["kind"], row["direction"]) for row in rows] == [
        ("command", "to robot"),
        ("response", "from robot"),
    ]
    assert rows[1]["time"] == "10:15:30.166"
    assert "10:15:30.166" in cli("decode", str(path), "--format", "table").out


def test_a_dump_is_no_hex_text(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "dump.txt"
    path.write_text(XXD, encoding="utf-8")
    assert raws(cli("decode", str(path), "--format", "jsonl").out) == [frame.hex() for frame in V2_FRAMES[:2]]


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        pytest.param("[10, 13, 16]", 2, "may be decimal or hexadecimal", id="ambiguous"),
        pytest.param("no-such-file", 8, "No such file", id="no file"),
        pytest.param("[256, 1]", 2, "256 in a list is no byte", id="no byte"),
    ],
)
def test_what_makes_no_sense_is_said(cli: Cli, text: str, code: int, message: str) -> None:
    ran = cli("decode", text)
    assert ran.code == code
    assert message in ran.err


def test_a_text_without_a_packet_is_an_error(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "letter.txt"
    path.write_text("Dear robot,\nhow are you?\n", encoding="utf-8")
    ran = cli("decode", str(path))
    assert ran.code == 8
    assert "no packet in" in ran.err


def test_lines_of_a_text_that_may_mean_several_things_are_said(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "pasted.txt"
    good = FORMS["decimal list"](V2_FRAMES[0])
    path.write_text(f"{good}\nadd\n[10, 13, 16]\nreceived [11, 12, 13]\n[retried 10]\n", encoding="utf-8")
    ran = cli("decode", str(path), "--format", "jsonl")
    assert ran.code == 0
    assert raws(ran.out) == [V2_FRAMES[0].hex()]
    assert "line 3 (and 1 more line): [10, 13, 16] may be decimal or hexadecimal" in ran.err
    path.write_text("robot says\n[10, 13, 16]\n", encoding="utf-8")
    ran = cli("decode", str(path))
    assert ran.code == 8
    assert "line 2: [10, 13, 16] may be decimal or hexadecimal" in ran.err
    assert "write 0x10, 0x13, 0x16" in ran.err
