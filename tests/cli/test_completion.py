"""Completion: what each shell is offered, that strangers' names stay harmless, that prompts stay quiet."""

import json
import os
import re
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.cli import COMPLETE_VARIABLE
from sphero_probe.cli.complete import shells
from sphero_probe.cli.complete.last_scan import MAX_ROBOTS, Remembered, cache_file, recall, remember
from sphero_probe.cli.group import COMMANDS
from sphero_probe.transports.base import Seen
from tests.support.cli import Cli

ROOT = Path(__file__).resolve().parents[2]
NEARBY = [
    Seen("BP-1234", ROBOTS["bolt-plus"], "AA:BB:CC:DD:EE:01", -40),
    Seen("$(reboot)", ROBOTS["mini"], "AA:BB:CC:DD:EE:02", -50),
    Seen("`id`", None, "; rm -rf", -60),
]
SAFE = re.compile(r"[A-Za-z0-9][A-Za-z0-9:._-]{0,39}")


Offered = Callable[..., list[str]]


@pytest.fixture
def offered(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Offered:
    """Ask as a shell's script does and give what it would read."""

    def ask(line: str, *, shell: str = "bash", word: str | None = None) -> list[str]:
        if shell == "bash":
            cursor = re.split(r"[\s:=]", line)[-1] if word is None else word
        elif shell == "fish":
            cursor = line.rpartition(" ")[2]
        else:
            cursor = str(len(line.split(" ")) - 1)
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", cursor)
        monkeypatch.setenv(COMPLETE_VARIABLE, f"{shell}_complete")
        capsys.readouterr()
        shells.answer()
        said = capsys.readouterr()
        assert said.err == ""
        return said.out.splitlines()

    return ask


def plain(lines: list[str]) -> list[str]:
    return [line.removeprefix("plain,") for line in lines if line.startswith("plain,")]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        pytest.param("sphero-probe sw", ["sweep"], id="command"),
        pytest.param("sphero-probe plan ", ["check", "list", "show"], id="subcommand"),
        pytest.param("sphero-probe sweep --dr", ["--dry-run"], id="option"),
        pytest.param("sphero-probe info --device BP", ["BP-1234"], id="robot-of-the-last-scan"),
        pytest.param("sphero-probe info -d ble:B", ["BP-1234"], id="robot-with-scheme"),
        pytest.param("sphero-probe info -d AA:BB:CC:DD:EE:", ["01", "02"], id="address"),
        pytest.param("sphero-probe info -d fake:bo", ["bolt", "bolt-plus"], id="model"),
        pytest.param("sphero-probe info --device=fake:bo", ["bolt", "bolt-plus"], id="after-equals"),
        pytest.param("sphero-probe info -d se", ["serial:"], id="scheme"),
        pytest.param("sphero-probe info -d rep", ["replay:"], id="recording"),
        pytest.param("sphero-probe send power.get_battery_p", ["power.get_battery_percentage"], id="name"),
        pytest.param("sphero-probe send power.sleep po", [], id="only-one-name"),
        pytest.param("sphero-probe send -d fake:ollie power.s", [], id="name-of-another-generation"),
        pytest.param("sphero-probe send -d fake:ollie sphero.ro", ["sphero.roll"], id="name-of-v1"),
        pytest.param("sphero-probe explain --v1 core.pi", ["core.ping"], id="explain-v1"),
        pytest.param("sphero-probe explain power.wa", ["power.wake"], id="explain"),
        pytest.param("sphero-probe catalog bri", ["brick"], id="filter"),
        pytest.param("sphero-probe catalog --robot bolt", ["bolt", "bolt-plus"], id="robot"),
        pytest.param("sphero-probe sweep --did po", ["power"], id="did"),
        pytest.param("sphero-probe sweep --did 0x10,po", ["0x10,power"], id="did-after-a-comma"),
        pytest.param("sphero-probe sweep -d fake:bb8 --did sp", ["sphero"], id="did-of-a-built-in-v1"),
        pytest.param("sphero-probe discover -d BB-1 --did sp", ["sphero"], id="did-of-a-named-v1"),
        pytest.param("sphero-probe sweep --plan self", ["self_description"], id="plan"),
        pytest.param("sphero-probe plan check hello pow", ["power"], id="second-plan"),
        pytest.param("sphero-probe report la", ["last"], id="last-run"),
        pytest.param("sphero-probe report 2026", ["20261122T000000Z-bp-1234-sweep"], id="kept-run"),
        pytest.param("sphero-probe sweep --resume la", ["last"], id="resume"),
        pytest.param("sphero-probe led --led fr", ["front="], id="lamp"),
        pytest.param("sphero-probe led -d fake:mini --led b", ["back=", "body="], id="lamp-of-a-robot"),
        pytest.param("sphero-probe sweep --allow b", ["brick"], id="risk"),
        pytest.param("sphero-probe runs --format js", ["json", "jsonl"], id="format"),
        pytest.param("sphero-probe sweep --target s", ["secondary"], id="node"),
        pytest.param("sphero-probe completion ", ["bash", "zsh", "fish"], id="shell"),
        pytest.param("sphero-probe swep --d", [], id="unknown-command"),
        pytest.param("sphero-probe sweep --timeout never --dr", ["--dry-run"], id="senseless-value"),
        pytest.param("sphero-probe info -d 'BP", ["BP-1234"], id="open-quote"),
    ],
)
def test_bash_is_offered(offered: Offered, line: str, expected: list[str]) -> None:
    remember(NEARBY)
    runs = Path(os.environ["XDG_STATE_HOME"]) / "sphero-probe" / "runs"
    runs.mkdir(parents=True)
    for name in ("20261122T000000Z-bp-1234-sweep.jsonl", "2026$(reboot).jsonl"):
        (runs / name).write_text("{}")
    word = "BP" if "'" in line else None
    assert sorted(set(plain(offered(line, word=word)))) == sorted(expected)


def test_every_command_is_offered(offered: Offered) -> None:
    assert sorted(plain(offered("sphero-probe "))) == sorted(COMMANDS)


def test_recorded_runs_and_files_can_be_replayed(offered: Offered) -> None:
    runs = Path(os.environ["XDG_STATE_HOME"]) / "sphero-probe" / "runs"
    runs.mkdir(parents=True)
    for name in ("20261122T000000Z-bp-1234-sweep.jsonl", "2026$(reboot).jsonl"):
        (runs / name).write_text("{}")
    said = offered("sphero-probe info -d replay:")
    assert plain(said) == [str(runs / "20261122T000000Z-bp-1234-sweep.jsonl")]
    assert "file," in said


@pytest.mark.parametrize("line", ["sphero-probe decode ", "sphero-probe runs -o x", "sphero-probe report "])
def test_files_are_left_to_the_shell(offered: Offered, line: str) -> None:
    assert f"file,{line.rpartition(' ')[2]}" in offered(line)


@pytest.mark.parametrize(
    ("line", "word", "expected"),
    [
        pytest.param("sphero-probe info -d fake:bolt-", "fake:bolt-", "fake:bolt-plus", id="no-colon"),
        pytest.param(
            "sphero-probe info --device=fake:bolt-",
            "--device=fake:bolt-",
            "--device=fake:bolt-plus",
            id="neither",
        ),
        pytest.param("sphero-probe info --device=fake:bolt-", "fake:bolt-", "fake:bolt-plus", id="equals"),
    ],
)
def test_bash_may_have_been_told_other_word_breaks(
    offered: Offered, line: str, word: str, expected: str
) -> None:
    assert plain(offered(line, word=word)) == [expected]


def test_zsh_and_fish_take_whole_words_and_remarks(offered: Offered) -> None:
    assert offered("sphero-probe info -d fake:bolt-", shell="zsh") == [
        "plain",
        r"fake\:bolt-plus",
        "built-in Sphero BOLT+",
    ]
    assert offered("sphero-probe info -d fake:bolt-", shell="fish") == [
        "plain,fake:bolt-plus\tbuilt-in Sphero BOLT+"
    ]
    assert offered("sphero-probe info --device=fake:bolt-", shell="fish") == [
        "plain,--device=fake:bolt-plus\tbuilt-in Sphero BOLT+"
    ]


@pytest.mark.parametrize(
    "instruction", ["bash_complete", "tcsh_complete", "zsh_complete", "1", "", "bash_source"]
)
def test_a_prompt_is_never_disturbed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], instruction: str
) -> None:
    for name in ("COMP_WORDS", "COMP_CWORD"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(COMPLETE_VARIABLE, instruction)
    code = shells.answer()
    said = capsys.readouterr()
    assert (code, said.err) == (0 if instruction == "bash_source" else 1, "")
    assert bool(said.out) == (instruction == "bash_source")


@pytest.mark.parametrize("shell", shells.SHELLS)
def test_the_script_is_one_that_the_shell_can_read(cli: Cli, shell: str, tmp_path: Path) -> None:
    ran = cli("completion", shell)
    assert ran.code == 0
    assert ran.err == ""
    assert "sphero-probe" in ran.out
    assert f"{COMPLETE_VARIABLE}={shell}_complete" in ran.out
    assert f"completion {shell} >> ~/" in cli("completion", "--help").out
    if shutil.which(shell):
        file = tmp_path / "script"
        file.write_text(ran.out)
        read = subprocess.run([shell, "-n", file], capture_output=True, text=True, check=False)
        assert (read.returncode, read.stderr) == (0, "")


def read_until(terminal: int, expected: bytes, *, patience: float = 20.0) -> bytes:
    said = b""
    end = time.monotonic() + patience
    while expected not in said and select.select([terminal], [], [], max(0.0, end - time.monotonic()))[0]:
        said += os.read(terminal, 4096).replace(b"\a", b"")
    return said


@pytest.mark.skipif(not shutil.which("bash") or sys.platform == "win32", reason="no bash here")
def test_a_real_bash_completes_across_colons(tmp_path: Path) -> None:
    remember(NEARBY)
    program = tmp_path / "sphero-probe"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sphero_probe "$@"\n')
    program.chmod(0o755)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COV")}
    environment |= {
        "PATH": f"{tmp_path}:{environment['PATH']}",
        "PYTHONPATH": str(ROOT),
        "PS1": "ready> ",
        "TERM": "dumb",
    }
    ours, theirs = os.openpty()
    with subprocess.Popen(
        ["bash", "--norc", "--noprofile", "-i"],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=environment,
        cwd=tmp_path,
        start_new_session=True,
    ) as bash:
        os.close(theirs)
        try:
            read_until(ours, b"ready> ")
            os.write(ours, b'eval "$(sphero-probe completion bash)"; echo do""ne\n')
            assert b"done" in read_until(ours, b"done\r\n")
            for typed, completed in (
                (b"info -d fake:bolt-\t", b"info -d fake:bolt-plus "),
                (b"info -d AA:BB:CC:DD:EE:\t2", b"info -d AA:BB:CC:DD:EE:02"),
                (b"led --led fr\tf00", b"led --led front=f00"),
            ):
                os.write(ours, b"sphero-probe " + typed)
                said = read_until(ours, completed)
                assert completed in said
                os.write(ours, b"\x15")
        finally:
            bash.kill()
            os.close(ours)


def test_what_a_scan_heard_is_remembered() -> None:
    assert recall() == []
    remember(NEARBY)
    assert recall() == [
        Remembered("BP-1234", "AA:BB:CC:DD:EE:01", "Sphero BOLT+"),
        Remembered("AA:BB:CC:DD:EE:02", "AA:BB:CC:DD:EE:02", "Sphero Mini"),
    ]
    remember([])
    assert len(recall()) == 2
    file = cache_file()
    assert file
    assert [path.name for path in file.parent.iterdir()] == [file.name]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.text(max_size=50), st.text(max_size=50)), max_size=70))
@example([("BP-1234", "-x")] * 70)
def test_whatever_robots_call_themselves_the_words_are_safe(heard: list[tuple[str, str]]) -> None:
    remember(Seen(name, None, address, -50) for name, address in heard)
    remembered = recall()
    assert len(remembered) <= MAX_ROBOTS
    for robot in remembered:
        assert SAFE.fullmatch(robot.name)
        assert robot.address == "" or SAFE.fullmatch(robot.address)


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"", id="empty"),
        pytest.param(b"\xff\xfe\x00", id="binary"),
        pytest.param(b"[" * 10_000, id="deep"),
        pytest.param(b'"robots"', id="text"),
        pytest.param(b'{"robots": {"a": 1}}', id="no-list"),
        pytest.param(b'{"robots": [1, null, [], {}, {"name": 7}]}', id="no-robots"),
        pytest.param(b'{"robots": [{"name": "a;b", "address": "$x", "model": "y"}]}', id="unsafe"),
        pytest.param(b'{"robots": [{"name": "BP-1"}]}' + b" " * 20_000, id="large"),
        pytest.param(json.dumps({"robots": [{"name": "x" * 41}]}).encode(), id="long"),
    ],
)
def test_a_spoilt_file_offers_nothing(content: bytes) -> None:
    file = cache_file()
    assert file
    file.parent.mkdir(parents=True)
    file.write_bytes(content)
    assert recall() == []


def test_a_model_that_is_no_model_is_left_out() -> None:
    file = cache_file()
    assert file
    file.parent.mkdir(parents=True)
    file.write_text(json.dumps({"robots": [{"name": "BP-1", "address": 3, "model": "a\x1b[31m`b`"}]}))
    assert recall() == [Remembered("BP-1", "", "a31mb")]


def test_where_nothing_can_be_kept_the_scan_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    remember(NEARBY)
    assert recall() == []
