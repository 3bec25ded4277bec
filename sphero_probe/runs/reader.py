"""Read a journal file, which may come from a stranger, and return the records of its run."""

import os
import stat
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import FLAGS, MAX_LINE, parse, why, without_collector
from sphero_probe.link.exchange import Silent
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.probing.recorder import PreviousResults
from sphero_probe.runs.decode import Intent, Opening, decode

MAX_FILE: Final = 1 << 29
"""Bytes of a journal."""


class Recorded(NamedTuple):
    """What a journal holds.

    Attributes:
        path: its file.
        opening: the first line; None if nothing is written.
        headings: one for each time the run started or resumed.
        findings: number -> the last finding of that probe, in the order in which the probes ended.
        intents: number -> the last intent to send that probe.
        entries: findings and notes in order, also those that later ones replace.
        summary: how the run ended the last time, None if it was cut off.
        valid_bytes: bytes up to the end of the last valid line.
        is_torn: the last line is incomplete.
    """

    path: Path
    opening: Opening | None
    headings: Sequence[Heading]
    findings: Mapping[int, Finding]
    intents: Mapping[int, Intent]
    entries: Sequence[Finding | Note]
    summary: Summary | None
    valid_bytes: int
    is_torn: bool

    @property
    def complete(self) -> bool:
        """Whether the run was finished."""
        return self.summary is not None and self.summary.complete

    @property
    def counts(self) -> dict[Outcome, int]:
        """Outcome -> number of findings."""
        words = [finding.outcome for finding in self.findings.values()]
        return {word: words.count(word) for word in Outcome if word in words}

    def earlier(self) -> PreviousResults:
        """Return which probes need not be sent again, and which must not be."""
        settled = {number: found for number, found in self.findings.items() if not _is_open(found)}
        doubtful = {number: sent.risk for number, sent in self.intents.items() if number not in settled}
        lenient: set[int | None] = set()
        for note in self.entries:
            target = note.data.get("target") if isinstance(note, Note) and note.kind == EXECUTED else False
            if target is None or (isinstance(target, int) and not isinstance(target, bool)):
                lenient.add(target)
        return PreviousResults(settled, doubtful, frozenset(lenient))

    def records(self) -> list[Record]:
        """Return the records of the run as if it had never been interrupted, findings by number."""
        last_profile = {
            calibrated(note): note for note in self.entries if isinstance(note, Note) and calibrated(note)
        }
        records: list[Record] = list(self.headings[-1:])
        by_number = iter(sorted(self.findings.values(), key=lambda finding: finding.number))
        for record in self.entries:
            if isinstance(record, Finding):
                valid = self.findings[record.number] is record
            else:
                node = calibrated(record)
                valid = node is None or last_profile[node] is record
            if valid:
                records.append(next(by_number) if isinstance(record, Finding) else record)
        if self.summary:
            records.append(self.summary._replace(counts=self.counts))
        return records


def calibrated(note: Note) -> tuple[int | None] | None:
    """Return the target that a note is the calibration of, of which the last counts; None for other notes."""
    target = note.data.get("target")
    if note.kind != "calibration" or not (target is None or isinstance(target, int)):
        return None
    return (target,)


def _is_open(finding: Finding) -> bool:
    """Whether the probe was interrupted, and can be sent again without executing anything twice."""
    unsettled = isinstance(finding.exchange, Silent) and finding.outcome is Outcome.INCONCLUSIVE
    return unsettled and finding.risk <= Risk.PROBE


def read_journal(path: Path) -> Recorded:
    """Return what a journal holds; a torn last line is skipped.

    Raises:
        BadInputFileError: it cannot be read, or is not a journal of this tool; the message names the line.
    """
    descriptor = open_to_read(path)
    try:
        with without_collector():
            return read_descriptor(descriptor, path)
    finally:
        os.close(descriptor)


def open_to_read(path: Path) -> int:
    """Return the descriptor of a journal.

    Raises:
        BadInputFileError: it cannot be read.
    """
    try:
        return os.open(path, os.O_RDONLY | FLAGS)
    except (OSError, ValueError) as error:
        raise BadInputFileError(f"{path}: {why(error)}", "see: sphero-probe runs") from error


def check_size(descriptor: int, path: Path) -> int:
    """Return the size of an open file in bytes.

    Raises:
        BadInputFileError: it is too large for a journal, or not a regular file.
    """
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        raise BadInputFileError(f"{path}: not a regular file")
    if status.st_size > MAX_FILE:
        raise BadInputFileError(f"{path}: larger than {MAX_FILE} bytes: not a journal")
    return status.st_size


def read_descriptor(descriptor: int, path: Path) -> Recorded:
    """Return what an open journal holds, from its start.

    Args:
        descriptor: open for reading; it stays open.
        path: its name, for messages.

    Raises:
        BadInputFileError: see ``read_journal``.
    """
    check_size(descriptor, path)
    opening: Opening | None = None
    headings: list[Heading] = []
    findings: dict[int, Finding] = {}
    intents: dict[int, Intent] = {}
    entries: list[Finding | Note] = []
    summary: Summary | None = None
    valid_bytes, is_torn = 0, False
    with os.fdopen(os.dup(descriptor), "rb") as file:
        file.seek(0)
        number = 0
        while line := file.readline(MAX_LINE + 1):
            number += 1
            if len(line) > MAX_LINE:
                raise BadInputFileError(f"{path}:{number}: a line of more than {MAX_LINE} bytes")
            try:
                data = parse(line)
            except BadLineError as error:
                if file.read(1) or (opening is None and not may_become_opening(line)):
                    raise BadInputFileError(f"{path}:{number}: {error}") from error
                is_torn = True
                break
            try:
                entry = decode(data, opening)
            except BadLineError as error:
                raise BadInputFileError(f"{path}:{number}: {error}") from error
            valid_bytes += len(line)
            is_torn = not line.endswith(b"\n")
            match entry:
                case Opening():
                    opening = entry
                case Heading():
                    headings.append(entry)
                    summary = None
                case Intent():
                    intents[entry.number] = entry
                case Finding():
                    findings.pop(entry.number, None)
                    findings[entry.number] = entry
                    entries.append(entry)
                case Note():
                    entries.append(entry)
                case Summary():
                    summary = entry
    return Recorded(path, opening, headings, findings, intents, entries, summary, valid_bytes, is_torn)


def may_become_opening(line: bytes) -> bool:
    """Whether a torn first line is the start of a journal."""
    begin = b'{"type":"journal",'
    return line.startswith(begin) or begin.startswith(line)
