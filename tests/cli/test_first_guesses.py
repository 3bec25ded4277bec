"""What people type before they have read the help, and standard streams that are closed."""

import json
import shlex
import subprocess
import sys

import pytest

from sphero_probe.runs.store import runs_folder
from tests.support.cli import Cli


@pytest.mark.parametrize(
    ("guess", "meant"),
    [
        pytest.param("help sweep", "sweep --help", id="help-command"),
        pytest.param("help", "--help", id="help"),
        pytest.param("help plan show", "plan show --help", id="help-of-a-subcommand"),
        pytest.param("-V", "--version", id="version"),
        pytest.param("explain 0x13", "explain power", id="a-device-by-number"),
        pytest.param("explain 19", "explain power", id="decimal"),
    ],
)
def test_a_guess_prints_what_it_stands_for(cli: Cli, guess: str, meant: str) -> None:
    guessed, typed = cli(*shlex.split(guess)), cli(*shlex.split(meant))
    assert guessed.code == typed.code == 0
    assert guessed.out == typed.out != ""


def test_verbose_before_the_command(cli: Cli) -> None:
    ran = cli("-v", "info", "--device", "fake:bolt")
    assert ran.code == 0
    assert "connect" in ran.err


def test_explain_lists_a_device(cli: Cli) -> None:
    ran = cli("explain", "power", "--json")
    rows = json.loads(ran.out)
    assert {row["did"] for row in rows} == {0x13}
    assert any(row["name"] == "power.get_battery_percentage" for row in rows)


def test_a_code_that_is_a_device_too_says_so(cli: Cli) -> None:
    ran = cli("explain", "--v1", "0x02")
    assert "bad checksum" in ran.out
    assert "explain sphero --v1" in ran.err
    assert cli("explain", "sphero", "--v1").code == 0


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        pytest.param(("13", "10"), "0x0d:0x0a", id="decimal"),
        pytest.param(("0x13", "10"), "0x13:0x0a", id="one-of-them"),
        pytest.param(("0x13", "0x10"), None, id="hexadecimal"),
        pytest.param(("0x13", "3"), None, id="one-digit-is-the-same-in-both"),
    ],
)
def test_numbers_are_shown_as_they_were_read(cli: Cli, typed: tuple[str, str], said: str | None) -> None:
    ran = cli("send", *typed, "--dry-run", "--device", "fake:mini")
    assert (f"is read as decimal: {said}" in ran.err) if said else ("decimal" not in ran.err)


@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        pytest.param("decode - <&-", 8, "standard input: ", id="input"),
        pytest.param("explain 0x05 >&-", 10, "standard output is closed", id="output"),
        pytest.param("--version >&-", 10, "standard output is closed", id="version"),
        pytest.param("explain 0x05 2>&-", 0, "", id="messages"),
        pytest.param("explain 0x05 -o {} >&-", 0, "", id="output-not-used"),
    ],
)
def test_a_closed_stream_is_no_bug(line: str, code: int, said: str, tmp_path: object) -> None:
    command = f"{shlex.quote(sys.executable)} -m sphero_probe {line.format(f'{tmp_path}/codes.json')}"
    ran = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, check=False)
    assert ran.returncode == code
    assert said in ran.stderr
    assert "Traceback" not in ran.stderr
    assert "bug" not in ran.stderr


@pytest.mark.parametrize(
    ("words", "fake", "code", "said"),
    [
        pytest.param("silent,inconclusive,incomplete", "", 0, "", id="none-occurs"),
        pytest.param("inconclusive", "?mask=1", 1, "inconclusive", id="inconclusive"),
        pytest.param("blocked", "", 1, "14 blocked", id="blocked"),
        pytest.param("silnt", "", 2, "did you mean 'silent'", id="unknown"),
    ],
)
def test_a_ci_job_fails_on_what_must_not_occur(cli: Cli, words: str, fake: str, code: int, said: str) -> None:
    ran = cli("sweep", "--did", "0x13", "--device", f"fake:bolt-plus{fake}", "--fail-on", words)
    assert ran.code == code
    assert said in ran.err


def test_a_ci_job_fails_on_an_incomplete_run(cli: Cli) -> None:
    sweep = ("sweep", "--did", "drive", "--target", "secondary", "--device", "fake:rvr?unavailable=2")
    assert cli(*sweep).code == 5
    ran = cli(*sweep, "--fail-on", "incomplete")
    assert ran.code == 1
    assert "the run is incomplete" in ran.err


def test_resume_last_takes_the_last_unfinished_run(cli: Cli) -> None:
    device = ("--device", "fake:bolt-plus")
    assert cli("sweep", "--did", "0x13", *device).code == 0
    (journal,) = runs_folder().iterdir()
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:200]))
    assert cli("sweep", "--did", "0x11", *device).code == 0
    assert cli("send", "power.wake", *device).code == 0

    def resumed() -> set[str]:
        ran = cli("sweep", "--resume", "last", *device)
        assert ran.code == 0, ran.err
        return {line.split("\t")[3] for line in ran.out.splitlines()}

    assert resumed() == {"0x13"}
    assert cli("sweep", "--did", "0x10", *device).code == 0
    assert cli("send", "power.wake", *device).code == 0
    assert resumed() == {"0x10"}  # none is unfinished: the last of this command
