"""Compares a fleet of robots with one robot: the time of a whole sweep, and the memory of the process."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from statistics import median
from time import monotonic
from typing import Final, NamedTuple

from benchmarks.section import Line, Options, Ratio, Remark, Section

ROBOTS: Final = 30
INTERVALS: Final = (15, 30)
"""Milliseconds between connection events."""
MOST_TIME: Final = 1.25
MOST_MEMORY: Final = 64.0
"""MiB for all robots of a fleet."""
_ROUNDS: Final = 3
_QUICK_ROUNDS: Final = 1
_KIBI: Final = 1024


class Ran(NamedTuple):
    """One command.

    Attributes:
        seconds: from its start to its end.
        cpu: seconds of processor time.
        mebibytes: the most memory that it had.
    """

    seconds: float
    cpu: float
    mebibytes: float


def measure(options: Options) -> Iterator[Line | Remark]:
    """Sweep one and many built-in robots in turn, each time with a new process, on the real clock."""
    if not hasattr(os, "wait4"):
        yield Remark("this system does not tell how much memory a process had")
        return
    yield Remark(f"whole commands: fleet sweep --did 0x13 on {ROBOTS} built-in robots, and on one, in turn;")
    yield Remark("the robots are simulated in the same process, and share its processor")
    for interval in INTERVALS:
        many: list[Ran] = []
        one: list[Ran] = []
        for _ in range(_QUICK_ROUNDS if options.quick else _ROUNDS):
            one.append(sweep(1, interval))
            many.append(sweep(ROBOTS, interval))
        over = sorted(fleet.seconds / single.seconds for fleet, single in zip(many, one, strict=True))
        cpu = median(ran.cpu for ran in many)
        note = f"{median(ran.seconds for ran in many):.1f} s, of which {cpu:.1f} s on the processor"
        what = f"fleet of {ROBOTS}, {interval} ms"
        yield Line(what, "one robot", _of(over), note=note, ceiling=MOST_TIME)
        used = sorted(ran.mebibytes for ran in many)
        share = _of([mebibytes / MOST_MEMORY for mebibytes in used])
        yield Line(what, f"{MOST_MEMORY:g} MiB", share, note=f"{median(used):.0f} MiB", ceiling=1.0)


def sweep(robots: int, interval: int) -> Ran:
    """Run one command to its end.

    Args:
        robots: how many built-in robots.
        interval: milliseconds between their connection events.
    """
    devices = [f"fake:bolt-plus?seed={seed}&interval={interval}ms" for seed in range(robots)]
    words = [word for device in devices for word in ("--device", device)]
    with tempfile.TemporaryDirectory() as folder:
        began = monotonic()
        process = subprocess.Popen(  # noqa: S603 - a command of our own
            [sys.executable, "-m", "sphero_probe", "fleet", "sweep", "--did", "0x13", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"XDG_STATE_HOME": folder},
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = monotonic() - began
    if process.returncode:
        raise AssertionError(f"a fleet of {robots} ended with exit code {process.returncode}")
    memory = used.ru_maxrss / _KIBI if sys.platform != "darwin" else used.ru_maxrss / _KIBI**2
    return Ran(seconds, used.ru_utime + used.ru_stime, memory)


def _of(ordered: list[float]) -> Ratio:
    return Ratio(median(ordered), ordered[0], ordered[-1])


SECTION = Section("fleet", "many robots at once compared with one: time and memory", measure)
