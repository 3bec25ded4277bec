"""Checks a run: compares it with its baseline, which it may write, and looks for unwanted outcomes."""

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from sphero_probe.catalogue.naming import choose
from sphero_probe.cli.messages import say
from sphero_probe.cli.output import show
from sphero_probe.cli.values import CheckOptions, Output
from sphero_probe.errors import BadInputFileError, OutputError, SpheroProbeError, UsageError
from sphero_probe.probing.finding import Finding, Heading, Outcome, Record, Summary
from sphero_probe.protocol.codec import Codec
from sphero_probe.reports.diff_rows import DIFFERENCES, count_row, diff_row, diff_rows, difference_row, ending
from sphero_probe.reports.diff_rows import warnings as diff_warnings
from sphero_probe.reports.diff_sections import line, robot_of
from sphero_probe.reports.phrases import counted_outcome
from sphero_probe.reports.registry import Report, Style, open_report
from sphero_probe.reports.rows import Row, finding_row, heading_row, summary_row
from sphero_probe.reports.views import FINDINGS
from sphero_probe.runs.diff import Diff, compare
from sphero_probe.runs.side_files import file_side
from sphero_probe.runs.sides import Side, observation_of, run_side

_SUFFIXES: Final = {".json": "json", ".jsonl": "jsonl"}
_PAGES: Final = ("table", "md")
_INCOMPLETE: Final = "incomplete"
_LINES: Final = 20
"""Differences that standard error lists at most."""


class Baseline:
    """What one run is checked against: its baseline, and the outcomes that must not occur.

    Attributes:
        diff: how the run differs from it, None before that is known, or where there is no baseline yet.
    """

    def __init__(self, options: CheckOptions) -> None:
        """Read the baseline, before anything is sent.

        Raises:
            UsageError: the options contradict each other, or the file's name is not that of a report in JSON.
            BadInputFileError: it cannot be read, or it does not exist and is not to be written.
            OutputError: it is to be written in a folder that does not exist.
        """
        self.diff: Diff | None = None
        self._file, self._update = options.file, options.update
        self._fail_on = (
            tuple(_outcome(word) for word in options.fail_on.split(",")) if options.fail_on else ()
        )
        self._side: Side | None = None
        self._heading: Heading | None = None
        self._findings: dict[int, Finding] = {}
        self._summary: Summary | None = None
        if self._file is None:
            if self._update:
                raise UsageError("--baseline-update needs --baseline FILE")
            return
        if self._update and Path(self._file).suffix.lower() not in _SUFFIXES:
            raise UsageError(f"{self._file}: a baseline is written as .json or .jsonl")
        if self._update and not Path(self._file).parent.is_dir():
            raise OutputError(f"cannot write {self._file}: its folder does not exist")
        if os.path.lexists(self._file):
            self._side = file_side(Path(self._file), self._file)
            if self._update and self._side.kind == "run":
                raise UsageError(f"{self._file}: this is a journal, which --baseline-update does not replace")
        elif not self._update:
            raise BadInputFileError(f"{self._file}: no such baseline", "write it with --baseline-update")

    def add(self, record: Record) -> None:
        """Take the next record of the run."""
        match record:
            case Heading():
                self._heading = record
            case Finding() if self._file is not None:
                self._findings[record.number] = record
            case Summary():
                self._summary = record

    def compare(self, codec: Codec, report: Report) -> None:
        """Compare a run that has ended, and add the differences to its report; only some formats show them.

        Args:
            codec: of the robot's protocol.
            report: of the run, still open.
        """
        if self._side is None:
            return
        observed = map(observation_of, self._findings.values())
        complete = self._summary is not None and self._summary.complete
        run = run_side("this run", "run", codec, self._heading, observed, complete=complete)
        self.diff = compare(self._side, run)
        for row in diff_rows(self.diff):
            report.add(row)

    def finish(self) -> None:
        """Write the baseline if that was asked for, and judge; for a complete run.

        Raises:
            SpheroProbeError: the run differs from its baseline, which is to stay; exit code 1.
            OutputError: the baseline cannot be written.
        """
        if self._file is None:
            return
        if self._update:
            _write(Path(self._file), self._rows())
            say(f"baseline written: {self._file}")
        elif self.diff and self.diff.differences:
            count = len(self.diff.differences)
            raise SpheroProbeError(
                f"{count} difference{'s' * (count > 1)} from the baseline {self._file}",
                "if they are right, accept them with --baseline-update",
            )

    def judge(self) -> None:
        """Look for outcomes that must not occur; for a run that has ended.

        Raises:
            SpheroProbeError: one occurs, or the run is incomplete and must not be; exit code 1.
        """
        counts = self._summary.counts if self._summary else {}
        complete = self._summary is not None and self._summary.complete
        found = [
            f"{counts.get(word, 0)} {counted_outcome(word.value)}" if word else "the run is incomplete"
            for word in self._fail_on
            if (counts.get(word) if word else not complete)
        ]
        if found:
            raise SpheroProbeError(f"failed by --fail-on: {', '.join(found)}")

    def keep(self) -> None:
        """Say that an incomplete run is not written as the baseline, if that was asked for."""
        if self._update:
            say("baseline not written: the run is incomplete")

    def _rows(self) -> list[Row]:
        """Return the run without its notes, which are not compared."""
        heading = [heading_row(self._heading)] if self._heading else []
        summary = [summary_row(self._summary)] if self._summary else []
        findings = (finding for _, finding in sorted(self._findings.items()))
        return [*heading, *map(finding_row, findings), *summary]

    def show(self, output: Output) -> None:
        """Show the differences: below the run's page where there is one, else in lines on standard error."""
        if self.diff is None:
            return
        if output.file is None and output.format in _PAGES:
            sys.stdout.write("\n")
            show(output, DIFFERENCES, diff_rows(self.diff))
            return
        head = diff_row(self.diff).data
        for text in diff_warnings(head):
            say(f"note: {text}")
        for one in self.diff.differences[:_LINES]:
            say(line(difference_row(one).data, robot_of(head)))
        if len(self.diff.differences) > _LINES:
            say(f"and {len(self.diff.differences) - _LINES} more")
        say(f"baseline: {ending(count_row(self.diff).data)}")


def _outcome(word: str) -> Outcome | None:
    """Return the outcome that a word names, None for ``incomplete``.

    Raises:
        UsageError: it names none.
    """
    known = {counted_outcome(one.value): one for one in Outcome} | {one.value: one for one in Outcome}
    word = choose(word.strip().lower(), [*known, _INCOMPLETE], "outcome")
    return known.get(word)


def _write(path: Path, rows: Sequence[Row]) -> None:
    """Write a report to a file, which is complete or as it was before."""
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with draft.open("x", encoding="utf-8", newline="") as out:
            report = open_report(_SUFFIXES[path.suffix.lower()], out, view=FINDINGS, style=Style())
            for row in rows:
                report.add(row)
            report.close()
        draft.replace(path)
    except OSError as error:
        with suppress(OSError):
            draft.unlink()
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
