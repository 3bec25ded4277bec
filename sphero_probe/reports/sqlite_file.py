"""Write runs into one SQLite file, which sqlite-utils, Datasette and DuckDB open as it is.

The schema is documented in docs/cookbook.md. Its version is ``PRAGMA user_version``. All text is made visible
first, as in every report; values are bound, never part of a statement.
"""

import json
import os
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Final

from sphero_probe.errors import OutputError
from sphero_probe.probing.finding import Finding, Heading, Note, Record, Summary
from sphero_probe.reports.printable import visible
from sphero_probe.reports.rows import finding_row
from sphero_probe.runs.decode import Opening

VERSION: Final = 1
"""Of the schema."""
_SCHEMA: Final = """
CREATE TABLE runs (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, command TEXT, plan TEXT, robot TEXT, model_key TEXT,
    model TEXT, generation TEXT, address TEXT, started TEXT, tool_version TEXT, consent TEXT, tags TEXT,
    complete INTEGER NOT NULL, seconds REAL, probes_sent INTEGER, frames_sent INTEGER
);
CREATE TABLE nodes (
    run_id INTEGER NOT NULL REFERENCES runs(id), node TEXT NOT NULL, firmware TEXT, strictness TEXT,
    PRIMARY KEY (run_id, node)
);
CREATE TABLE findings (
    run_id INTEGER NOT NULL REFERENCES runs(id), number INTEGER NOT NULL, target INTEGER,
    answered_by INTEGER, did INTEGER NOT NULL, cid INTEGER NOT NULL, name TEXT, risk TEXT, outcome TEXT,
    state TEXT, confidence TEXT, code INTEGER, code_name TEXT, payload TEXT, fields TEXT, units TEXT,
    sent TEXT, received TEXT, rtt_ms REAL, attempts INTEGER, note TEXT,
    PRIMARY KEY (run_id, number)
);
CREATE TABLE notes (
    run_id INTEGER NOT NULL REFERENCES runs(id), number INTEGER NOT NULL, kind TEXT, text TEXT, data TEXT,
    PRIMARY KEY (run_id, number)
);
"""
_INDICES: Final = """
CREATE INDEX runs_robot ON runs(robot);
CREATE INDEX runs_model ON runs(model_key);
CREATE INDEX findings_command ON findings(did, cid);
CREATE INDEX findings_outcome ON findings(outcome);
CREATE INDEX notes_kind ON notes(kind);
"""
_FINDING: Final = (
    *("number", "target", "answered_by", "did", "cid", "name", "risk", "outcome", "state", "confidence"),
    *("code", "code_name", "payload", "fields", "units", "sent", "received", "rtt_ms", "attempts", "note"),
)
"""The keys of a finding's row, in the order of the columns after ``run_id``."""
_INSERT_FINDING: Final = f"INSERT INTO findings VALUES (?{', ?' * len(_FINDING)})"  # noqa: S608 - no data
_FINDINGS_AT_ONCE: Final = 1000
_LARGEST: Final = 1 << 63
"""The first number that is too large for SQLite."""

_Value = str | int | float | None


class RunsFile:
    """An SQLite file of runs that is being written."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self._database = database

    def add(
        self, name: str, opening: Opening, records: Iterable[Record], tags: Sequence[str], *, complete: bool
    ) -> None:
        """Write a run.

        Args:
            name: the run's name, unique.
            opening: the first line of its journal.
            records: its records.
            tags: its tags.
            complete: whether it was finished.

        Raises:
            BadInputFileError: the journal is damaged; nothing of the run is written.
            OutputError: the file cannot be written.
        """
        try:
            self._database.execute("SAVEPOINT run")
            try:
                self._add(name, opening, records, tags, complete=complete)
            except BaseException:
                self._database.execute("ROLLBACK TO run")
                raise
            finally:
                self._database.execute("RELEASE run")
        except sqlite3.Error as error:
            raise OutputError(f"cannot write the SQLite file: {error}", "is the disk full?") from error

    def _add(
        self, name: str, opening: Opening, records: Iterable[Record], tags: Sequence[str], *, complete: bool
    ) -> None:
        first = (name, opening.command, opening.plan, opening.device, opening.robot)
        more = (opening.generation.value, opening.address, _json(opening.consent), _json(tags), complete)
        run = self._database.execute(
            "INSERT INTO runs (name, command, plan, robot, model_key, generation, address, consent, tags,"
            " complete) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [*map(_value, first), *map(_value, more)],
        ).lastrowid
        findings: list[list[_Value]] = []
        notes = 0
        for record in records:
            match record:
                case Heading():
                    self._heading(run, record)
                case Finding():
                    data = finding_row(record).data
                    findings.append([run, *(_value(data[key]) for key in _FINDING)])
                    if len(findings) == _FINDINGS_AT_ONCE:
                        self._insert_findings(findings)
                case Note():
                    notes += 1
                    held = [run, notes, *map(_value, (record.kind, record.text, record.data))]
                    self._database.execute("INSERT INTO notes VALUES (?, ?, ?, ?, ?)", held)
                case Summary():
                    self._database.execute(
                        "UPDATE runs SET seconds = ?, probes_sent = ?, frames_sent = ? WHERE id = ?",
                        [record.seconds, record.probes_sent, record.frames_sent, run],
                    )
                    self._nodes(run, {}, record.strictness)
        self._insert_findings(findings)

    def _heading(self, run: int | None, heading: Heading) -> None:
        said = (heading.model, heading.started, heading.tool_version)
        self._database.execute(
            "UPDATE runs SET model = ?, started = ?, tool_version = ? WHERE id = ?", [*map(_value, said), run]
        )
        self._nodes(run, heading.firmware, heading.strictness)

    def _nodes(self, run: int | None, firmware: Mapping[str, str], strictness: Mapping[str, str]) -> None:
        """Insert what is known of nodes, or add it to what is there."""
        self._database.executemany(
            "INSERT INTO nodes VALUES (?, ?, ?, ?) ON CONFLICT DO UPDATE SET"
            " firmware = coalesce(firmware, excluded.firmware),"
            " strictness = coalesce(excluded.strictness, strictness)",
            [
                [run, *map(_value, (node, firmware.get(node), strictness.get(node)))]
                for node in {**firmware, **strictness}
            ],
        )

    def _insert_findings(self, findings: list[list[_Value]]) -> None:
        if findings:
            self._database.executemany(_INSERT_FINDING, findings)
            findings.clear()


@contextmanager
def runs_file(path: Path) -> Iterator[RunsFile]:
    """Write an SQLite file; it appears under its name when the block ends without an error, else not at all.

    Raises:
        OutputError: it cannot be written.
    """
    try:
        descriptor, draft = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:40]}-", suffix=".tmp")
        os.close(descriptor)
    except (OSError, ValueError) as error:
        raise OutputError(f"cannot write {path}: {_why(error)}") from error
    try:
        with closing(sqlite3.connect(draft, isolation_level=None)) as database:
            database.executescript(f"PRAGMA user_version = {VERSION}; PRAGMA synchronous = OFF; {_SCHEMA}")
            database.execute("BEGIN")
            yield RunsFile(database)
            database.execute("COMMIT")
            database.executescript(_INDICES)
        Path(draft).replace(path)
    except (sqlite3.Error, OSError) as error:
        raise OutputError(f"cannot write {path}: {_why(error)}") from error
    finally:
        with suppress(OSError):
            Path(draft).unlink()


def _why(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else "") or str(error)


def _value(value: object) -> _Value:
    """Return what SQLite keeps of a value: text is made visible, objects and lists become JSON."""
    match value:
        case None | float():
            return value
        case int() if -_LARGEST <= value < _LARGEST:
            return value
        case dict() | list() | tuple():
            return _json(value)
        case _:
            return visible(str(value), limit=None)


def _json(value: object) -> str:
    """Return a value as JSON in ASCII."""
    return json.dumps(value).replace("\x7f", "\\u007f")
