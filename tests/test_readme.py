"""The README and the pages in docs/: every command line runs, and every command is shown."""

import io
import re
import shlex
from pathlib import Path

import pytest

from sphero_probe.cli.group import COMMANDS
from sphero_probe.errors import SpheroProbeError
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.simulator.settings import KEYS
from sphero_probe.transports.replay import KEYS as REPLAY_KEYS
from tests.support.captures import CAPTURES
from tests.support.cli import Cli
from tests.support.fake_bluez import FakeBlueZ, Peripheral, sphero_v2

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {"README.md": README} | {
    f"docs/{path.name}": path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("*.md"))
}
LINE = re.compile(r"^(?:\$|\s+- run:) sphero-probe (.+)$", re.MULTILINE)
"""A command line in a transcript, or in the steps of a workflow file."""
LINES = {line: page for page, text in reversed(PAGES.items()) for line in LINE.findall(text)}
"""Command line -> the first page that shows it."""
LONG = ("discover --device BP-1234",)
"""Command lines that take long over the fake BlueZ."""
SETUP = re.findall(r"^python3 -m venv .+$", README, re.MULTILINE)


def test_it_is_short_and_starts_with_a_transcript() -> None:
    assert len(README.splitlines()) < 250
    assert README.index("```console") < README.index("\n## ")
    assert len(LINE.findall(README)) >= 15


def without_times(page: str) -> list[str]:
    """Return the lines of a run's table without what differs between runs: date, times, widths of columns."""
    page = re.sub("─+", "─", re.sub(r"Started \S+Z", "Started", page))
    return [
        re.sub(r" +", " ", re.sub(r" +\d+\.\d$", "", re.sub(r"in \d+\.\d s$", "in s", line)))
        for line in page.splitlines()
        if line
    ]


def test_the_transcript_is_what_the_tool_prints(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    line, _, shown = README.split("```console\n$ sphero-probe ")[1].split("```")[0].partition("\n")
    monkeypatch.setenv("COLUMNS", "96")
    ran = cli(*shlex.split(line), "--format", "table", "--color", "never")
    assert len(without_times(shown)) > 20
    assert without_times(shown) == without_times(ran.out)


def test_the_cookbook_teaches_by_command_lines() -> None:
    assert len(LINE.findall(PAGES["docs/cookbook.md"])) >= 12


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "line",
    [
        pytest.param(line, id=f"{LINES[line]}: {line}", marks=[pytest.mark.slow] if line in LONG else [])
        for line in LINES
    ],
)
def test_every_line_runs(cli: Cli, line: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "probe_plans").symlink_to(ROOT / "probe_plans")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "btsnoop_hci.log").write_bytes(CAPTURES["btsnoop 1002"]())
    if "replay:run.jsonl" in line:
        cli("sweep", "--did", "0x13", "--device", "fake:bolt-plus", "--journal", "run.jsonl")
    (tmp_path / "class.toml").write_text('[[robot]]\nname = "BP-1234"\n', encoding="utf-8")
    if "last" in line or line.startswith(("runs", "matrix")):
        cli("sweep", "--did", "0x13", "--device", "fake:bolt-plus")
    if "my-robot.json" in line:
        cli("evidence", "--device", "fake:bolt-plus", "-o", "my-robot")
    for name in re.findall(r"\b(?:before|after)\.json\b", line) if line.startswith("diff") else ():
        cli("sweep", "--did", "0x13", "--device", "fake:bolt-plus", "-o", name)
    if "--baseline " in line and "--baseline-update" not in line:
        cli(*shlex.split(line), "--baseline-update")
    robot = FakeRobot(parse_settings("bolt-plus"))
    with FakeBlueZ(
        [Peripheral("BP-1234", "AA:BB:CC:DD:EE:01", robot=robot, services=sphero_v2(gate=False))]
    ) as air:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", air.address)
        monkeypatch.setattr("sys.stdin", io.StringIO("explain 0x05\n"))  # for the shell
        ran = cli(*shlex.split(line))
    assert ran.code == 0, ran.err
    assert ran.out or "-o" in line or line.startswith(("runs prune", "runs export"))
    if "bolt-plus.jsonl" in line:
        assert (tmp_path / "bolt-plus.jsonl").read_text().count('"type": "finding"') == 256


def test_the_two_setup_lines_are_those_that_ci_runs() -> None:
    ci = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    use, test = SETUP
    assert use in ci
    assert test in ci


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_in_it(command: str) -> None:
    assert f"$ sphero-probe {command}" in README


@pytest.mark.parametrize("key", [*KEYS, *REPLAY_KEYS])
def test_every_key_of_a_simulated_robot_has_a_row(key: str) -> None:
    assert f"`{key}=" in PAGES["docs/built-in-robot.md"]


def test_every_exit_code_is_in_it() -> None:
    def codes(kind: type[SpheroProbeError]) -> set[int]:
        return {kind.exit_code}.union(*map(codes, kind.__subclasses__()))

    table = README.split("## Exit codes")[1].split("\n## ")[0]
    written = {int(number) for number in re.findall(r"\| (\d+)(?=,? )", table)}
    assert codes(SpheroProbeError) - {5} <= written
