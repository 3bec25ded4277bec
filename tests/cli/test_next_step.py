"""What a terminal is told after a complete run: the next commands, and that they work as printed."""

import shlex
from pathlib import Path

import pytest

from tests.support.cli import Cli
from tests.support.terminal import on_terminal

SWEEP = ("sweep", "--did", "0x13", "--cid", "0-0x1f", "--color", "never", "--device")


def suggestions(shown: str) -> list[list[str]]:
    """The commands in what a terminal showed, without the program."""
    lines = [line for line in shown.splitlines() if line.startswith("next: ")]
    commands = [shlex.split(line.removeprefix("next: ")) for line in lines]
    assert {command[0] for command in commands} <= {"sphero-probe"}
    return [command[1:] for command in commands]


def on_screen(cli: Cli, *arguments: str) -> list[list[str]]:
    with pytest.MonkeyPatch.context() as patch:
        terminal = on_terminal(patch)
        cli(*arguments)
        return suggestions(terminal.getvalue())


def test_the_report_is_suggested_and_a_comparison_once_there_is_another_run(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert on_screen(cli, *SWEEP, "fake:bolt") == [["report", "last", "-o", "map.html"]]
    assert on_screen(cli, *SWEEP, "fake:mini") == [["report", "last", "-o", "map.html"]]
    report, diff = on_screen(cli, *SWEEP, "fake:bolt")
    assert (diff[0], diff[2]) == ("diff", "last")
    assert cli(*report).code == 0
    assert (tmp_path / "map.html").read_text("utf-8").startswith("<!DOCTYPE html>")
    compared = cli(*diff, "--format", "plain")
    assert (compared.code, compared.out) == (0, "")


def test_a_journal_elsewhere_is_named(cli: Cli, tmp_path: Path) -> None:
    journal = tmp_path / "my run.jsonl"
    suggested = on_screen(cli, *SWEEP, "fake:bolt", "--journal", str(journal))
    assert suggested == [["report", str(journal), "-o", "map.html"]]


def test_a_map_is_not_suggested_to_who_just_wrote_it(cli: Cli, tmp_path: Path) -> None:
    assert on_screen(cli, *SWEEP, "fake:bolt", "-o", str(tmp_path / "map.html")) == []


@pytest.mark.parametrize(
    "asked",
    [
        pytest.param((*SWEEP, "fake:bolt", "--no-journal"), id="no-journal"),
        pytest.param((*SWEEP, "fake:bolt", "--dry-run"), id="dry-run"),
        pytest.param((*SWEEP, "fake:rvr?unavailable=2", "--target", "secondary"), id="incomplete"),
    ],
)
def test_nothing_is_suggested_without_a_complete_journal(cli: Cli, asked: tuple[str, ...]) -> None:
    assert on_screen(cli, *asked) == []


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_nothing_is_suggested_where_a_stream_is_piped(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, stream: str
) -> None:
    terminal = on_terminal(monkeypatch)
    monkeypatch.undo()
    monkeypatch.setattr(f"sys.{stream}", terminal)
    ran = cli(*SWEEP, "fake:bolt", "--format", "table")
    assert "next: " not in terminal.getvalue() + ran.out + ran.err
