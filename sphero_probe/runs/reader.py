"""Read a journal file, which may come from a stranger, and return the records of its run."""

import os
import stat
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import FLAGS, MAX_LINE, parse, why, without_collector
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.runs.decode import Entry, Intent, Opening, decode

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
    headings: list[Heading] = []
    findings: dict[int, Finding] = {}
    intents: dict[int, Intent] = {}
    entries: list[Finding | Note] = []
    summary: Summary | None = None
    with os.fdopen(os.dup(descriptor), "rb") as file:
        held = JournalEntries(file, path)
        for _, entry in held:
            match entry:
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
    ends = held.valid_bytes, held.is_torn
    return Recorded(path, held.opening, headings, findings, intents, entries, summary, *ends)


class JournalEntries:
    """The entries of an open journal, each with the place of its line; a torn last line is skipped.

    Attributes:
        opening: the first line, once it was read; None if nothing is written.
        valid_bytes: bytes up to the end of the last valid line that was read.
        is_torn: the last line is incomplete.
    """

    def __init__(self, file: BinaryIO, path: Path) -> None:
        """Take an open file.

        Args:
            file: open for reading.
            path: its name, for messages.
        """
        self._file, self._path = file, path
        self.opening: Opening | None = None
        self.valid_bytes = 0
        self.is_torn = False

    def __iter__(self) -> Iterator[tuple[int, Entry]]:
        """Read the file from its start; yield the offset of each line and its entry, after the opening.

        Raises:
            BadInputFileError: a line is damaged, or this is no journal of this tool; the message names it.
        """
        self._file.seek(0)
        number = 0
        while line := self._file.readline(MAX_LINE + 1):
            number += 1
            try:
                entry = self._entry(line)
            except BadLineError as error:
                raise BadInputFileError(f"{self._path}:{number}: {error}") from error
            if entry is None:
                self.is_torn = True
                return
            offset = self.valid_bytes
            self.valid_bytes += len(line)
            self.is_torn = not line.endswith(b"\n")
            if isinstance(entry, Opening):
                self.opening = entry
            else:
                yield offset, entry

    def _entry(self, line: bytes) -> Entry | None:
        """Return the entry of a line, None for a torn last line."""
        if len(line) > MAX_LINE:
            raise BadLineError(f"a line of more than {MAX_LINE} bytes")
        try:
            data = parse(line)
        except BadLineError:
            if self._file.read(1) or (self.opening is None and not may_become_opening(line)):
                raise
            return None
        return decode(data, self.opening)


def may_become_opening(line: bytes) -> bool:
    """Whether a torn first line is the start of a journal."""
    begin = b'{"type":"journal",'
    return line.startswith(begin) or begin.startswith(line)
