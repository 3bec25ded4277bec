"""What is imported, and when: help and completion answer before anything heavy is loaded."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sphero_probe.cli import COMPLETE_VARIABLE
from sphero_probe.cli.group import COMMANDS
from sphero_probe.cli.invoke import run

ROOT = Path(__file__).resolve().parents[2]
PLAN_COMMANDS = (("plan", "list"), ("plan", "show"), ("plan", "check"))
HELPS = ((), *((name,) for name in COMMANDS), *PLAN_COMMANDS)
HEAVY = {"asyncio", "bleak", "dbus_fast", "rich", "serialx"}
SLOW = {
    "argparse",
    "dataclasses",
    "difflib",
    "json",
    "logging",
    "pathlib",
    "shutil",
    "signal",
    "subprocess",
    "tempfile",
    "traceback",
}
"""Of the standard library: each costs a millisecond or more, and click does not need it either."""
LAYERS = (
    "diagnostics",
    "reports",
    "runs",
    "probing",
    "session",
    "link",
    "transports",
    "simulator",
    "catalogue",
    "protocol",
)
"""All of ours but the command line and the exceptions."""

HELP = """
import json, sys, click
seen = set(sys.modules)
from sphero_probe.cli.invoke import run
imported = {}
for words in json.loads(sys.argv[1]):
    run([*words, "--help"])
    imported[" ".join(words)] = sorted(set(sys.modules) - seen)
    seen |= set(sys.modules)
print("IMPORTED", json.dumps(imported))
"""
VERSION = """
import sys
seen = set(sys.modules)
sys.argv[1:] = ["--version"]
from sphero_probe.cli import main
try:
    main()
except SystemExit:
    print("IMPORTED", *set(sys.modules) - seen)
"""
COMPLETE = """
import os, sys
from sphero_probe.cli.complete.shells import answer
for line in sys.argv[1:]:
    os.environ.update(COMP_WORDS=line, COMP_CWORD="", _SPHERO_PROBE_COMPLETE="bash_complete")
    assert answer() == 0
print("IMPORTED", *sys.modules)
"""


def tell(code: str, *arguments: str) -> str:
    """Run code in a fresh interpreter without coverage, which imports a lot itself."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COV")}
    ran = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env=environment,
    )
    return ran.stdout.split("IMPORTED ")[1]


def test_the_version_is_told_with_next_to_nothing() -> None:
    assert set(tell(VERSION).split()) == {"sphero_probe", "sphero_probe.cli"}


def test_help_imports_nothing_slow() -> None:
    imported = json.loads(tell(HELP, json.dumps(HELPS)))
    assert "sphero_probe.cli.group" in imported[""]
    for command, modules in imported.items():
        assert not (HEAVY | SLOW) & set(modules), command
        assert not [name for name in modules if name.startswith(tuple(f"sphero_probe.{x}" for x in LAYERS))]
        assert not [name for name in modules if name.startswith("sphero_probe.cli.actions")], command


def test_completion_imports_nothing_heavy() -> None:
    imported = tell(
        COMPLETE,
        "sphero-probe ",
        "sphero-probe info --device ",
        "sphero-probe send ",
        "sphero-probe sweep --plan ",
        "sphero-probe led --led ",
        "sphero-probe report ",
    )
    assert not HEAVY & set(imported.split())


@pytest.mark.parametrize("words", [(), ("sweep",)], ids=["group", "command"])
@pytest.mark.parametrize(
    ("columns", "widest"),
    [("60", 58), ("200", 78), ("1", 50), ("many", 78), ("٣", 78), ("9" * 5000, 78)],
    ids=["narrow", "wide", "tiny", "word", "arabic", "endless"],
)
def test_help_fills_the_terminal(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str],
    columns: str,
    widest: int,
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert run([*words, "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert widest - 12 <= max(map(len, lines)) <= max(widest, 78 if widest == 50 else 0)


def test_asking_for_completion_ends_the_program_quietly() -> None:
    environment = os.environ | {COMPLETE_VARIABLE: "nonsense"}
    ran = subprocess.run(
        [sys.executable, "-m", "sphero_probe"], capture_output=True, env=environment, check=False, cwd=ROOT
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (1, b"", b"")
