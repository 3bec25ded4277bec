"""Where reports go: files and standard output, at once where a command is live, and what hinders that."""

import io
import json
import re
import sys
from pathlib import Path

import pytest

from sphero_probe.cli.messages import say
from sphero_probe.cli.output import report
from sphero_probe.cli.progress_bar import count_text, found_text, left_text, progress_bar, stage_text
from sphero_probe.cli.run import progress
from sphero_probe.cli.values import FORMATS, Output
from sphero_probe.errors import OutputError
from sphero_probe.probing.facts import Fact
from sphero_probe.probing.progress import Progress
from sphero_probe.reports.registry import PAGES
from sphero_probe.reports.rows import fact_row
from sphero_probe.reports.streams import takes_unicode
from sphero_probe.reports.views import FACTS
from tests.support.cli import Cli
from tests.support.terminal import on_terminal

STREAMING = ("sphero.set_data_streaming 0028000100006000 00", "--allow", "write", "--device", "fake:bb8")
AT_ONCE = [name for name in FORMATS if name not in PAGES]
"""The formats that write row by row; a page is made of all rows."""


def value_of(number: int) -> str:
    return f"value-{number}"


@pytest.mark.parametrize("name", AT_ONCE)
def test_a_live_report_can_be_read_while_it_grows(tmp_path: Path, name: str) -> None:
    file = tmp_path / "facts"
    with report(Output(name, str(file), "auto"), FACTS, live=True) as rows:
        for number in range(3):
            rows.add(fact_row(Fact("fact", value_of(number))))
            assert value_of(number) in file.read_text("utf-8")
            assert value_of(number + 1) not in file.read_text("utf-8")
    assert value_of(2) in file.read_text("utf-8")


@pytest.mark.parametrize("name", AT_ONCE)
def test_so_it_is_on_standard_output(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(raw, "utf-8", write_through=False))
    with report(Output(name, None, "auto"), FACTS, live=True) as rows:
        rows.add(fact_row(Fact("fact", value_of(1))))
        assert value_of(1).encode() in raw.getvalue()


def test_a_report_of_many_rows_is_not_flushed_row_by_row(tmp_path: Path) -> None:
    file = tmp_path / "facts"
    with report(Output("jsonl", str(file), "auto"), FACTS) as rows:
        rows.add(fact_row(Fact("fact", value_of(1))))
        assert file.read_text("utf-8") == ""
    assert value_of(1) in file.read_text("utf-8")


@pytest.mark.parametrize("name", FORMATS)
def test_live_or_not_the_report_is_the_same(tmp_path: Path, name: str) -> None:
    written = []
    for live in (False, True):
        file = tmp_path / str(live)
        with report(Output(name, str(file), "auto"), FACTS, live=live) as rows:
            for number in range(2):
                rows.add(fact_row(Fact("fact", value_of(number))))
        written.append(file.read_bytes())
    assert written[0] == written[1]


def test_listen_writes_each_packet_as_it_comes(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    seen: list[int] = []

    class Watched(io.TextIOWrapper):
        def flush(self) -> None:
            super().flush()
            seen.append(raw.getvalue().count(b"\n"))

    monkeypatch.setattr("sys.stdout", Watched(raw, "utf-8"))
    ran = cli("listen", "--count", "3", "--format", "jsonl", "--send", *STREAMING)
    assert ran.code == 0, ran.err
    assert {1, 2, 3} <= set(seen)
    assert [json.loads(line)["kind"] for line in raw.getvalue().splitlines()] == ["notification"] * 3


FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.exists(), reason="no disk that is always full")
def test_listen_to_a_full_disk_is_no_lost_link(cli: Cli) -> None:
    ran = cli("listen", "--seconds", "20", "--format", "jsonl", "-o", str(FULL), "--send", *STREAMING)
    assert ran.code == OutputError.exit_code
    assert "cannot write /dev/full" in ran.err


def test_listen_to_a_reader_that_is_gone_ends_quietly(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    class Gone(io.StringIO):
        def flush(self) -> None:
            if self.getvalue():
                raise BrokenPipeError

    monkeypatch.setattr("sys.stdout", Gone())
    ran = cli("listen", "--seconds", "20", "--format", "jsonl", "--send", *STREAMING)
    assert (ran.code, ran.err) == (OutputError.exit_code, "")


@pytest.mark.parametrize(
    ("environment", "all_of_it"),
    [
        pytest.param({}, True, id="nothing-said"),
        pytest.param({"LANG": "de_DE.UTF-8"}, True, id="utf-8"),
        pytest.param({"LC_ALL": "C"}, False, id="c"),
        pytest.param({"LC_ALL": "POSIX", "LANG": "de_DE.UTF-8"}, False, id="posix-overrides"),
        pytest.param({"LANG": "C"}, False, id="c-by-default"),
        pytest.param({"LANG": "C", "LC_CTYPE": "C.UTF-8"}, True, id="c-but-for-characters"),
        pytest.param({"LC_ALL": "C", "PYTHONUTF8": "1"}, True, id="the-interpreter-is-told-otherwise"),
    ],
)
def test_what_may_be_written_is_a_matter_of_the_locale(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, environment: dict[str, str], all_of_it: bool
) -> None:
    terminal = on_terminal(monkeypatch)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert takes_unicode(sys.stdout) is all_of_it
    say("漢\x1b[2J")
    assert terminal.getvalue() == ("漢\\x1b[2J\n" if all_of_it else "\\u6f22\\x1b[2J\n")
    with (tmp_path / "file").open("w", encoding="utf-8") as file:
        assert takes_unicode(file)


def test_a_standard_error_that_is_gone_is_borne(monkeypatch: pytest.MonkeyPatch) -> None:
    class Gone(io.StringIO):
        def write(self, _: str) -> int:
            raise BrokenPipeError

    monkeypatch.setattr("sys.stderr", Gone())
    say("nobody hears this")
    monkeypatch.setattr("sys.stderr", None)
    say("nor this")


HALFWAY = Progress("devices", 4, 6, 30, 120, is_total_known=False, exist=12, new=2, seconds_left=7.2)


@pytest.mark.parametrize(
    ("progress_so_far", "said"),
    [
        pytest.param(HALFWAY, ["stage 4/6: devices", "30/120+", "12 exist, 2 new", "0:08+ left"], id="more"),
        pytest.param(
            HALFWAY._replace(is_total_known=True, new=0),
            ["stage 4/6: devices", "30/120", "12 exist", "0:08 left"],
            id="known",
        ),
        pytest.param(
            Progress("calibrating", 1, 1, 0, 3072), ["calibrating", "0/3072", "", ""], id="the-only-stage"
        ),
        pytest.param(
            HALFWAY._replace(stage="a\x1b[2J" + 40 * "b", seconds_left=3725.0),
            ["stage 4/6: a\\x1b[2Jbbbbbbbbbbbbbbb…", "30/120+", "12 exist, 2 new", "1:02:05+ left"],
            id="hostile-name",
        ),
    ],
)
def test_a_bar_says_how_far_the_run_is(progress_so_far: Progress, said: list[str]) -> None:
    texts = (stage_text, count_text, found_text, left_text)
    assert [text(progress_so_far) for text in texts] == said


def test_a_narrow_terminal_shows_the_stage_and_the_time_left_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    terminal = on_terminal(monkeypatch)
    monkeypatch.setenv("COLUMNS", "44")
    with progress_bar("sweep", color=False, unicode=True) as show_progress:
        show_progress(HALFWAY)
    line = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", terminal.getvalue()).split("\r")[-1].split("\n")
    assert len(line[0]) <= 44
    assert "stage 4/6: devices" in terminal.getvalue()
    assert "0:08+ left" in terminal.getvalue()


@pytest.mark.parametrize("color", [True, False], ids=["colour", "plain"])
@pytest.mark.parametrize("unicode", [True, False], ids=["unicode", "ascii"])
def test_a_progress_bar_shows_what_the_terminal_can(
    monkeypatch: pytest.MonkeyPatch, color: bool, unicode: bool
) -> None:
    terminal = on_terminal(monkeypatch)
    with progress_bar("sweep", color=color, unicode=unicode) as show_progress:
        show_progress(HALFWAY)
    sent = terminal.getvalue()
    for said in ("stage 4/6: devices", "30/120+", "12 exist, 2 new", "0:08+ left"):
        assert said in sent
    assert sent.isascii() is not unicode
    assert bool(re.search(r"\x1b\[[0-9;]*m", sent)) is color


def test_what_is_said_meanwhile_stands_above_the_bar_and_the_bar_goes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    terminal = on_terminal(monkeypatch)
    with progress_bar("sweep", color=False, unicode=True) as show_progress:
        show_progress(HALFWAY)
        terminal.truncate(0)
        say("stopping")
        assert re.match(r"\0*\r\x1b\[2Kstopping *\nsweep", terminal.getvalue())
    assert terminal.getvalue().endswith("\x1b[2K")


@pytest.mark.parametrize("name", FORMATS)
def test_rows_that_run_over_a_terminal_are_not_mixed_with_a_bar(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    terminal = on_terminal(monkeypatch)
    with progress("sweep", Output(name, None, "never")) as show_progress:
        show_progress(HALFWAY)
    assert bool(terminal.getvalue()) is (name in PAGES)


def test_a_terminal_shows_the_run_on_one_screen_when_the_report_goes_to_a_file(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    sweep = ("sweep", "--did", "0x10,0x13", "--device", "fake:bolt", "--color", "never", "-o")
    assert cli(*sweep, str(tmp_path / "piped.jsonl")).err == ""
    terminal = on_terminal(monkeypatch)
    cli(*sweep, str(tmp_path / "map.jsonl"))
    told = re.split(r"\x1b\[[0-9;?]*[A-Za-z]|\r", terminal.getvalue())[-1].splitlines()
    assert told[0].startswith("Sphero BOLT SB-DE8E over BLE, firmware: ")
    assert told[1].startswith("512 probes: ")
    assert f"The whole report is in {tmp_path / 'map.jsonl'}." in told[-3:]
    assert len(told) < 24
