"""What resuming a run needs of its journal; the findings stay in the file until they are asked for."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import MAX_LINE, parse
from sphero_probe.link.exchange import Silent
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.probing.recorder import PreviousResults
from sphero_probe.runs.decode import Intent, Opening, decode
from sphero_probe.runs.reader import JournalEntries


class InterruptedRun:
    """A journal that was read once, and checked.

    Attributes:
        opening: the first line; None if nothing is written.
        headings: one for each time the run started or resumed.
        valid_bytes: bytes up to the end of the last valid line.
        is_torn: the last line is incomplete.
        earlier: which probes need not be sent again, and which must not be; to be used before ``close``.
    """

    def __init__(self, file: BinaryIO, path: Path) -> None:
        """Read a journal from its start.

        Args:
            file: open for reading, until the run is closed; then it is closed, too.
            path: its name, for messages.

        Raises:
            BadInputFileError: it is not a journal of this tool; the message names the line.
        """
        self._file = file
        self.headings: list[Heading] = []
        offsets: dict[int, int] = {}
        sent: dict[int, Risk] = {}
        lenient: set[int | None] = set()
        entries = JournalEntries(file, path)
        for offset, entry in entries:
            match entry:
                case Heading():
                    self.headings.append(entry)
                case Intent(number=number, risk=risk) if risk > Risk.PROBE:
                    sent[number] = risk
                case Intent(number=number):
                    sent.pop(number, None)
                case Finding(number=number):
                    offsets.pop(number, None)
                    if not _is_open(entry):
                        offsets[number] = offset
                case Note(kind=kind) if kind == EXECUTED:
                    target = entry.data.get("target")
                    if target is None or (isinstance(target, int) and not isinstance(target, bool)):
                        lenient.add(target)
        self.opening, self.valid_bytes, self.is_torn = entries.opening, entries.valid_bytes, entries.is_torn
        doubtful = {number: risk for number, risk in sent.items() if number not in offsets}
        settled = _SettledFindings(file, path, self.opening, offsets)
        self.earlier = PreviousResults(settled, doubtful, frozenset(lenient))

    def close(self) -> None:
        """Close the file; the findings cannot be read any more."""
        self._file.close()


class _SettledFindings(Mapping[int, Finding]):
    """Number -> finding, read from the journal each time it is asked for."""

    def __init__(
        self, file: BinaryIO, path: Path, opening: Opening | None, offsets: Mapping[int, int]
    ) -> None:
        self._file, self._path, self._opening, self._offsets = file, path, opening, offsets

    def __len__(self) -> int:
        return len(self._offsets)

    def __iter__(self) -> Iterator[int]:
        return iter(self._offsets)

    def __contains__(self, number: object) -> bool:
        return number in self._offsets

    def __getitem__(self, number: int) -> Finding:
        """Return a finding.

        Raises:
            KeyError: there is none of this number.
            BadInputFileError: the file was changed meanwhile.
        """
        self._file.seek(self._offsets[number])
        try:
            entry = decode(parse(self._file.readline(MAX_LINE + 1)), self._opening)
        except BadLineError as error:
            raise BadInputFileError(f"{self._path}: the finding {number} was changed: {error}") from error
        if not isinstance(entry, Finding) or entry.number != number:
            raise BadInputFileError(f"{self._path}: the finding {number} was changed: it is something else")
        return entry


def _is_open(finding: Finding) -> bool:
    """Whether the probe was interrupted, and can be sent again without executing anything twice."""
    unsettled = isinstance(finding.exchange, Silent) and finding.outcome is Outcome.INCONCLUSIVE
    return unsettled and finding.risk <= Risk.PROBE
