"""Measures how long ``--version`` and every ``--help`` take."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import Final

from benchmarks.process import environment
from benchmarks.section import Line, Options, Remark, Section
from benchmarks.timing import race, ratio
from sphero_probe.cli.group import COMMANDS

_VERSION: Final = ("--version",)
_PLAN_COMMANDS: Final = (("plan", "list"), ("plan", "show"), ("plan", "check"))
_HELPS: Final = tuple((*words, "--help") for words in ((), *((name,) for name in COMMANDS), *_PLAN_COMMANDS))
_ENTRY: Final = "from sphero_probe.cli import main; main()"
_MOST_ROUNDS: Final = 7
_YARDSTICKS: Final = {"pass": 1.2, "import click": 1.3}
"""Code for a bare interpreter -> how many times as long the tool may take."""


def measure(options: Options) -> Iterator[Line | Remark]:
    """Time every command against a bare interpreter, and against one that only imports click."""
    module = [sys.executable, "-m", "sphero_probe"]
    script = Path(sys.executable).with_name("sphero-probe")
    tool = [str(script)] if script.exists() else module
    yield Remark(
        f"whole processes of {'sphero-probe as installed' if tool != module else 'python -m sphero_probe'}; "
        "1.0x is the time allowed"
    )
    yield Remark("the entry point alone excludes the imports of pip's launcher (re) and of python -m (runpy)")
    runners: dict[str, Callable[[], object]] = {
        code: partial(_start, [sys.executable, "-c", code]) for code in _YARDSTICKS
    }
    helps = _HELPS[:3] if options.quick else _HELPS
    runners |= {" ".join(words): partial(_start, [*tool, *words]) for words in (_VERSION, *helps)}
    runners["entry"] = partial(_start, [sys.executable, "-c", _ENTRY, *_VERSION])
    runners["module"] = partial(_start, [*module, *_VERSION])
    seconds = race(runners, min(options.rounds, _MOST_ROUNDS))
    yield _line("--version", "pass", seconds, "--version")
    yield _line("--version, the entry point alone", "pass", seconds, "entry")
    if tool != module:
        yield _line("--version of python -m sphero_probe", "pass", seconds, "module")
    for words in map(" ".join, helps):
        yield _line(words, "import click", seconds, words)


def _line(what: str, code: str, seconds: dict[str, list[float]], name: str) -> Line:
    """Compare with the time allowed, a multiple of the bare interpreter's time in the same round."""
    times = _YARDSTICKS[code]
    took, bare = median(seconds[name]), median(seconds[code])
    return Line(
        what,
        f"{times:g} x {code}",
        ratio([times * one for one in seconds[code]], seconds[name]),
        1.0,
        note=f"{took * 1e3:.0f} ms, {took / bare:.2f} x the {bare * 1e3:.0f} ms",
    )


def _start(command: list[str]) -> None:
    """Run a process to its end."""
    subprocess.run(  # noqa: S603 - commands of our own
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True, env=environment()
    )


SECTION = Section("startup", "the time that --version and every --help take", measure)
