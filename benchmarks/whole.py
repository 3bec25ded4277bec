"""Measures a sweep of all commands in a process: its memory for each probe, and resuming half of it."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.process import Spent, spent
from benchmarks.section import Line, Options, Ratio, Remark, Section
from benchmarks.timing import ratio

_FEW, _ALL, _QUICK_ALL = 16, 256, 64
"""Devices that are swept, with 256 commands each."""
_COMMANDS: Final = 256
_ROBOT: Final = ("--device", "fake:bolt-plus?latency=0ms")
_STREAMED: Final = ("jsonl", "plain", "csv")
MOST_BYTES: Final = 128
"""Bytes per probe, where the findings are printed as they come."""
MOST_SECONDS: Final = 7.0
"""For resuming half of all commands."""
_ROUNDS: Final = 3
_MEBI: Final = 1 << 20


def measure(options: Options) -> Iterator[Line | Remark]:
    """Sweep few and all devices of a built-in robot, then cut the journal in half and resume it."""
    devices, rounds = (_QUICK_ALL, 1) if options.quick else (_ALL, _ROUNDS)
    probes = devices * _COMMANDS
    yield Remark(f"whole commands: sweep of {_FEW * _COMMANDS} and of {probes} commands of a built-in robot")
    yield Remark("that answers at once; the robot is simulated in the same process")
    with TemporaryDirectory() as folder:
        journal = Path(folder) / "run.jsonl"
        for form in (*_STREAMED, "table"):
            few = sweep(_FEW, "--format", form)
            every = sweep(devices, "--format", form, "--journal", str(journal))
            whole = journal.read_bytes()
            journal.unlink()
            if few.mebibytes and every.mebibytes:
                yield _memory(form, few.mebibytes, every.mebibytes, probes)
        resumed: list[Spent] = []
        for _ in range(rounds):
            journal.write_bytes(whole[: len(whole) // 2])
            resumed.append(resume(journal))
    best, limit = min(resumed), MOST_SECONDS * devices / _ALL
    peak = f", {best.mebibytes:.0f} MiB" if best.mebibytes else ""
    yield Line(
        f"sweep --resume, half of {probes} probes",
        f"{limit:g} s",
        ratio([limit] * rounds, [ran.seconds for ran in resumed]),
        None if options.quick else 1.0,
        note=f"{best.seconds:.1f} s, of which {best.cpu:.1f} s on the processor{peak}",
    )


def sweep(devices: int, *options: str) -> Spent:
    """Sweep all commands of so many devices.

    Args:
        devices: at least 1, at most 256.
        options: further ones of the command.
    """
    return spent("sweep", "--did", f"0x00-0x{devices - 1:02x}", *_ROBOT, *options)


def resume(journal: Path) -> Spent:
    """Resume a sweep from the journal that it left."""
    return spent("sweep", "--resume", str(journal), *_ROBOT, "--format", "jsonl")


def _memory(form: str, few: float, every: float, probes: int) -> Line:
    """Return how much more memory a process needs for each further probe."""
    each = (every - few) * _MEBI / (probes - _FEW * _COMMANDS)
    share = Ratio(*[each / MOST_BYTES] * 3)
    return Line(
        f"sweep --format {form}: memory per probe",
        f"{MOST_BYTES} bytes",
        share,
        note=f"{each:.0f} bytes: {few:.0f} MiB for {_FEW * _COMMANDS} probes, {every:.0f} MiB for {probes}",
        ceiling=1.0 if form in _STREAMED else None,
    )


SECTION = Section("whole", "a sweep of all commands: its memory for each probe, resuming half of it", measure)
