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
