"""Read the records of a run one by one, so that the memory of a report does not grow with the run.

The journal is read twice: first to learn which findings and calibrations later ones replace, and how the run
ended; then each record is decoded when it is needed. Intents are skipped, because no report shows them.
"""

import os
from array import array
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, Self

from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import MAX_LINE, parse
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.runs.decode import Entry, Opening, decode
from sphero_probe.runs.reader import calibrated, check_size, may_become_opening, open_to_read

_INTENT: Final = b'{"type":"intent",'
_FINDING: Final = b'{"type":"finding","number":'
_NOTE: Final = 0
"""Stands for a note among the numbers of findings, which count from 1."""
_MOST_DIGITS: Final = 10


class RecordStream:
    """The records of a journal; a context manager that opens and closes the file.

    Attributes:
        path: the journal.
        opening: its first line; None if nothing is written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.opening: Opening | None = None
        self._file: BinaryIO
        self._heading: Heading | None = None
        self._summary: Summary | None = None
        self._findings: dict[int, int] = {}  # number -> offset of the last finding
        self._calibrations: dict[tuple[int | None], int] = {}  # target -> offset of the last calibration
        self._numbers, self._offsets = array("Q"), array("Q")  # of the findings and notes, in order

    def __enter__(self) -> Self:
        """Open the journal and read it for the first time.

        Raises:
            BadInputFileError: it cannot be read, or is no journal of this tool; the message names the line.
        """
        descriptor = open_to_read(self.path)
        try:
            size = check_size(descriptor, self.path)
        except BaseException:
            os.close(descriptor)
            raise
        self._file = os.fdopen(descriptor, "rb")
        try:
            self._read_all(size)
        except BaseException:
            self._file.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def records(self) -> Iterator[Record]:
        """Yield the records of the run as if it had never been interrupted, findings by number.

        Raises:
            BadInputFileError: a line is damaged; the message names it.
        """
        if self._heading:
            yield self._heading
        counts: Counter[Outcome] = Counter()
        by_number = iter(sorted(self._findings.items()))
        for number, offset in zip(self._numbers, self._offsets, strict=True):
            if number != _NOTE:
                if self._findings[number] == offset:
                    finding = self._entry(next(by_number)[1])
                    assert isinstance(finding, Finding)
                    counts[finding.outcome] += 1
                    yield finding
            else:
                note = self._entry(offset)
                assert isinstance(note, Note)
                node = calibrated(note)
                if node is None or self._calibrations[node] == offset:
                    yield note
        if self._summary:
            yield self._summary._replace(counts={word: counts[word] for word in Outcome if counts[word]})

    def _read_all(self, size: int) -> None:
        offset = 0
        while line := self._file.readline(MAX_LINE + 1):
            self._learn(line, offset, last=offset + len(line) >= size)
            offset += len(line)

    def _learn(self, line: bytes, offset: int, *, last: bool) -> None:
        """Note what the first reading must know of a line; only the last may be torn."""
        if len(line) > MAX_LINE:
            raise self._bad(offset, f"a line of more than {MAX_LINE} bytes")
        if self.opening and not last:
            if line.startswith(_INTENT):
                return
            if line.startswith(_FINDING):
                digits = line[len(_FINDING) : len(_FINDING) + _MOST_DIGITS + 1].partition(b",")[0]
                if digits.isdigit() and len(digits) <= _MOST_DIGITS:
                    self._place(int(digits), offset)
                    return
        try:
            data = parse(line)
        except BadLineError as error:
            if last and (self.opening or may_become_opening(line)):
                return
            raise self._bad(offset, str(error)) from error
        try:
            entry = decode(data, self.opening)
        except BadLineError as error:
            raise self._bad(offset, str(error)) from error
        match entry:
            case Opening():
                self.opening = entry
            case Heading():
                self._heading, self._summary = entry, None
            case Finding(number=number):
                self._place(number, offset)
            case Note():
                self._place(_NOTE, offset)
                if node := calibrated(entry):
                    self._calibrations[node] = offset
            case Summary():
                self._summary = entry

    def _place(self, number: int, offset: int) -> None:
        self._numbers.append(number)
        self._offsets.append(offset)
        if number != _NOTE:
            self._findings[number] = offset

    def _entry(self, offset: int) -> Entry:
        self._file.seek(offset)
        try:
            return decode(parse(self._file.readline(MAX_LINE + 1)), self.opening)
        except BadLineError as error:
            raise self._bad(offset, str(error)) from error

    def _bad(self, offset: int, problem: str) -> BadInputFileError:
        self._file.seek(0)
        number = self._file.read(offset).count(b"\n") + 1
        return BadInputFileError(f"{self.path}:{number}: {problem}")
