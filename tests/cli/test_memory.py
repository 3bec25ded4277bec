"""The memory of a sweep, where findings are printed as they come, does not grow with its probes."""

from pathlib import Path
from typing import Final

import pytest

from benchmarks.process import spent
from benchmarks.whole import MOST_BYTES

pytestmark = [
    pytest.mark.slow,
    pytest.mark.unmeasured,
    pytest.mark.skipif(
        not Path("/proc/self/status").exists(),
        reason="only Linux tells the peak memory of a process in /proc",
    ),
]
ROBOT: Final = "fake:bolt-plus?latency=0ms"
FEW, MANY = "0x00-0x0f", "0x00-0x7f"
MORE_PROBES: Final = (128 - 16) * 256


def peak(*arguments: str) -> float:
    """Return the most memory that a command has, in MiB."""
    mebibytes = spent("sweep", *arguments).mebibytes
    assert mebibytes
    return mebibytes


def each(few: float, many: float) -> float:
    """Return the bytes for each further probe."""
    return (many - few) * (1 << 20) / MORE_PROBES


@pytest.mark.parametrize(
    ("device", "form"),
    [
        (ROBOT, "jsonl"),
        (ROBOT, "plain"),
        (ROBOT, "csv"),
        pytest.param(f"{ROBOT}&silent=0x02:0x00", "jsonl", id="one silent"),
    ],
)
def test_no_finding_is_kept_that_nothing_reads(device: str, form: str) -> None:
    few, many = (peak("--device", device, "--format", form, "--did", dids) for dids in (FEW, MANY))
    assert each(few, many) < MOST_BYTES


def test_the_findings_of_an_interrupted_run_stay_in_its_journal(tmp_path: Path) -> None:
    journal = tmp_path / "run.jsonl"
    options = ("--device", ROBOT, "--format", "jsonl")
    peak(*options, "--did", MANY, "--journal", str(journal))
    whole = journal.read_bytes()
    journal.write_bytes(whole[: len(whole) // 2])
    assert each(peak(*options, "--did", FEW), peak(*options, "--resume", str(journal))) < 2 * MOST_BYTES
    assert len(journal.read_bytes()) >= 0.9 * len(whole)
