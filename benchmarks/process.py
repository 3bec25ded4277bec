"""Runs one command in a new process, and tells what it cost: time, processor time and peak memory."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import monotonic
from typing import Final, NamedTuple

_STATUS: Final = Path("/proc/self/status")
_KIBI: Final = 1024
_CHILD: Final = f"""
import os, re, sys, time
from sphero_probe.cli.invoke import run
code = run(sys.argv[1:])
peak = 0
if os.path.exists("{_STATUS}"):
    peak = re.search("VmHWM:[^0-9]*([0-9]+) kB", open("{_STATUS}").read())[1]
print(code, time.process_time(), peak, file=sys.__stderr__)
"""
"""On Linux, what ``wait4`` and ``getrusage`` tell of a new process's memory includes its parent's."""


def environment() -> dict[str, str]:
    """Return the variables for a process that may keep its bytecode, as an installed tool does."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


class Spent(NamedTuple):
    """What one command cost.

    Attributes:
        seconds: from its start to its end.
        cpu: seconds of processor time.
        mebibytes: the most memory that it had; None where the system does not tell.
    """

    seconds: float
    cpu: float
    mebibytes: float | None


def spent(*arguments: str, code: int = 0) -> Spent:
    """Run ``sphero-probe`` with these arguments and an empty folder of runs.

    Args:
        *arguments: of the command line.
        code: its exit code.

    Raises:
        RuntimeError: it ended with another exit code.
    """
    with tempfile.TemporaryDirectory() as folder:
        began = monotonic()
        ran = subprocess.run(  # noqa: S603 - a command of our own
            [sys.executable, "-c", _CHILD, *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            check=False,
            text=True,
            env=environment() | {"XDG_STATE_HOME": folder},
        )
        seconds = monotonic() - began
    words = ran.stderr.split()[-3:]
    if ran.returncode or not words or words[0] != str(code):
        raise RuntimeError(f"{arguments[0]} failed: {ran.stderr[-200:]}")
    return Spent(seconds, float(words[1]), int(words[2]) / _KIBI or None)
