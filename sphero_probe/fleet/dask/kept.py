"""What the client keeps of the run on one robot, for the next worker if this one dies."""

import zlib
from io import BytesIO
from pathlib import Path

from sphero_probe.catalogue.risk import Risk
from sphero_probe.fleet.records import FleetRecord
from sphero_probe.probing.finding import Finding, Heading, Note
from sphero_probe.runs.decode import Intent
from sphero_probe.runs.reader import JournalEntries
from sphero_probe.runs.resume import RunJournal


class KeptRun:
    """The journal of one robot's run, and which of its records were told."""

    def __init__(self, journal: RunJournal) -> None:
        """Keep a run.

        Args:
            journal: entered; it may keep no file.
        """
        self._journal = journal
        resumed = journal.journal is not None and journal.opening is not None
        self._lines = bytearray(Path(journal.place).read_bytes() if resumed else b"")
        self._findings: dict[int, tuple[object, ...]] = {}
        self._notes: list[Note] = []
        self._begun = False

    @property
    def place(self) -> str:
        """The path of the journal, empty if no file is kept."""
        return self._journal.place

    @property
    def lines(self) -> bytes:
        """The journal so far, compressed with zlib."""
        return zlib.compress(self._lines, 1)

    @property
    def may_have_executed(self) -> bool:
        """Whether a command above the class ``probe`` may have been sent.

        Raises:
            BadInputFileError: the lines are not those of a journal.
        """
        entries = JournalEntries(BytesIO(self._lines), Path(self.place))
        return any(isinstance(entry, Intent) and entry.risk > Risk.PROBE for _, entry in entries)

    def append(self, lines: bytes) -> None:
        """Write whole lines to the journal.

        Raises:
            BadLineError: the first line of a new journal is not an opening.
            OutputError: a journal that the user named cannot be written.
        """
        if lines:
            self._journal.append(lines)
            self._lines += lines

    def is_news(self, record: FleetRecord) -> bool:
        """Whether a record was not told before; a run that is resumed begins with those of before."""
        match record:
            case Heading():
                known, self._begun = self._begun, True
                return not known
            case Note():
                known = record in self._notes
                if not known:
                    self._notes.append(record)
                return not known
            case Finding(number=number):
                said = (record.outcome, record.confidence, record.note)
                known = self._findings.get(number) == said
                self._findings[number] = said
                return not known
        return True
