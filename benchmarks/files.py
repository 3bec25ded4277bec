"""Measures what people wait for with recorded runs: their list, reports, the journal of a resumed run."""

import json
import os
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from unittest.mock import patch

from benchmarks.journal import kept
from benchmarks.process import spent
from benchmarks.section import Line, Options, Remark, Section
from benchmarks.timing import race, ratio
from sphero_probe.probing.finding import Heading, Outcome, Summary
from sphero_probe.protocol.packets import Generation
from sphero_probe.runs.decode import Opening
from sphero_probe.runs.encode import encode, encode_finding, encode_intent
from sphero_probe.runs.reader import read_journal

_RUNS: Final = 2000
_FINDINGS: Final = 1 << 16
_MOST_ROUNDS: Final = 3
"""A round reads the large journal six times, which takes long."""
_SMALL: Final = 256
"""Findings of each run in the list."""
_LIST_LIMIT, _REPORT_LIMIT = 0.5, 2.5
"""Seconds."""
_FORMATS: Final = ("jsonl", "plain", "csv", "table")


def measure(options: Options) -> Iterator[Line | Remark]:
    """Yield the times of the list, of reports and of reading a journal, and the memory of a report."""
    runs, findings = (200, 1 << 12) if options.quick else (_RUNS, _FINDINGS)
    rounds = min(options.rounds, _MOST_ROUNDS)
    yield Remark(f"simulated: {runs} journals of {_SMALL} findings each, one of {findings}")
    with TemporaryDirectory() as folder:
        state = Path(folder) / "sphero-probe" / "runs"
        state.mkdir(parents=True)
        small = _journal(_SMALL)
        for number in range(runs):
            (state / f"{number}.jsonl").write_bytes(small)
        with patch.dict(os.environ, {"XDG_STATE_HOME": folder}):
            listed = race({"runs": partial(_command, "runs", "--format", "plain")}, rounds)["runs"]
        yield Line(
            f"runs, {runs} journals",
            f"{_LIST_LIMIT * runs / _RUNS:g} s",
            ratio([_LIST_LIMIT * runs / _RUNS] * rounds, listed),
            1.0,
            note=f"{min(listed):.2f} s",
        )
        file = Path(folder) / "large.jsonl"
        file.write_bytes(_journal(findings))
        tasks: dict[str, Callable[[], object]] = {
            name: partial(_command, "report", str(file), "--format", name) for name in _FORMATS
        }
        reading: dict[str, Callable[[], object]] = {
            "json": partial(_only_json, file),
            "resume": partial(read_journal, file),
        }
        times = race(tasks | reading, rounds)
        limit = _REPORT_LIMIT * findings / _FINDINGS
        for name in _FORMATS:
            bar = None if name == "table" else 1.0
            yield Line(
                f"report --format {name}, {findings} findings",
                f"{limit:g} s",
                ratio([limit] * rounds, times[name]),
                bar,
                note=f"{min(times[name]):.2f} s{_peak(file, name)}",
            )
        yield Line(
            f"reading a journal of {findings} findings to resume it",
            "json.loads of its lines",
            ratio(times["resume"], times["json"]),
            note=f"{min(times['resume']):.2f} s",
        )


def _journal(count: int) -> bytes:
    """Return the journal of a finished run."""
    probes = [kept(number) for number in range(1, count + 1)]
    exist = sum(finding.outcome is Outcome.EXISTS for _, finding in probes)
    counts = {Outcome.EXISTS: exist, Outcome.ABSENT: count - exist}
    opening = Opening("sweep", "sweep", "", {}, "", "fake:bolt", Generation.V2, "bolt", "SB-1", ("read",))
    heading = Heading(
        "bolt", "Sphero BOLT", "SB-1", {}, "sweep", "0.1.0", ("read",), {}, "2026-01-02T03:04:05Z"
    )
    lines = [encode(opening), encode(heading)]
    for asked, finding in probes:
        lines += [encode_intent(asked.number, asked.command, asked.risk), encode_finding(finding)]
    return b"".join([*lines, encode(Summary(counts, 99.0, count, count, True))])


def _command(*arguments: str) -> None:
    code = import_module("sphero_probe.cli.invoke").run((*arguments, "-o", os.devnull))
    if code:
        raise RuntimeError(f"{arguments[0]} ended with {code}")


def _only_json(file: Path) -> None:
    """Parse the lines, and do nothing with them."""
    with file.open("rb") as lines:
        for line in lines:
            json.loads(line)


def _peak(file: Path, name: str) -> str:
    """Return the largest resident size of a process that prints the report, empty where it is not told."""
    peak = spent("report", str(file), "--format", name).mebibytes
    return f", {peak:.0f} MiB in a process" if peak else ""


SECTION = Section("files", "the list of runs, reports of recorded runs, reading a journal", measure)
