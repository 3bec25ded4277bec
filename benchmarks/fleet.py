"""Compares a fleet of robots with one robot: the time of a whole sweep, and the memory of the process."""

from collections.abc import Iterator
from statistics import median
from typing import Final

from benchmarks.process import Spent, spent
from benchmarks.section import Line, Options, Ratio, Remark, Section

ROBOTS: Final = 30
INTERVALS: Final = (15, 30)
"""Milliseconds between connection events."""
MOST_TIME: Final = 1.25
MOST_MEMORY: Final = 64.0
"""MiB for all robots of a fleet."""
_ROUNDS: Final = 3
_QUICK_ROUNDS: Final = 1


def measure(options: Options) -> Iterator[Line | Remark]:
    """Sweep one and many built-in robots in turn, each time with a new process, on the real clock."""
    yield Remark(f"whole commands: fleet sweep --did 0x13 on {ROBOTS} built-in robots, and on one, in turn;")
    yield Remark("the robots are simulated in the same process, and share its processor")
    for interval in INTERVALS:
        many: list[Spent] = []
        one: list[Spent] = []
        for _ in range(_QUICK_ROUNDS if options.quick else _ROUNDS):
            one.append(sweep(1, interval))
            many.append(sweep(ROBOTS, interval))
        over = sorted(fleet.seconds / single.seconds for fleet, single in zip(many, one, strict=True))
        cpu = median(ran.cpu for ran in many)
        note = f"{median(ran.seconds for ran in many):.1f} s, of which {cpu:.1f} s on the processor"
        what = f"fleet of {ROBOTS}, {interval} ms"
        yield Line(what, "one robot", _of(over), note=note, ceiling=MOST_TIME)
        if used := sorted(ran.mebibytes for ran in many if ran.mebibytes):
            share = _of([mebibytes / MOST_MEMORY for mebibytes in used])
            yield Line(what, f"{MOST_MEMORY:g} MiB", share, note=f"{median(used):.0f} MiB", ceiling=1.0)


def sweep(robots: int, interval: int) -> Spent:
    """Run one command to its end.

    Args:
        robots: how many built-in robots.
        interval: milliseconds between their connection events.
    """
    devices = [f"fake:bolt-plus?seed={seed}&interval={interval}ms" for seed in range(robots)]
    return spent("fleet", "sweep", "--did", "0x13", *(f"--device={device}" for device in devices))


def _of(ordered: list[float]) -> Ratio:
    return Ratio(median(ordered), ordered[0], ordered[-1])


SECTION = Section("fleet", "many robots at once compared with one: time and memory", measure)
