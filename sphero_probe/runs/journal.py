"""Write the journal of a run, line by line, so that the run can be resumed however it ends.

The first line says what to do (``Opening``). The others are written as things happen: a heading each time the
run starts or resumes, an intent before every frame of a probe, findings, notes, a summary. Each line is one
``write`` to a file opened for append. So a killed process leaves whole lines and at most one torn line.
"""

import os
from contextlib import ExitStack
from pathlib import Path
from typing import Final, Self

from sphero_probe.errors import BadInputFileError, OutputError
from sphero_probe.json_files import FLAGS, why
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.finding import Finding, Heading, Record
from sphero_probe.runs.decode import Opening
from sphero_probe.runs.encode import encode, encode_finding, encode_intent
from sphero_probe.runs.interrupted import InterruptedRun
from sphero_probe.runs.lock import lock
from sphero_probe.runs.reader import check_size
from sphero_probe.session.identity import Identity, difference

_APPEND: Final = os.O_APPEND | FLAGS


class Journal:
    """An open journal that records the intents and results of a run; only one run may write it at a time.

    Attributes:
        path: its file.
        interrupted: the run that the file held when it was reopened, None for a new journal.
        resumable: enough is written to resume the run.
    """

    def __init__(
        self, descriptor: int, path: Path, interrupted: InterruptedRun | None, *, ours: bool
    ) -> None:
        self.path = path
        self.interrupted = interrupted
        self.resumable = interrupted is not None and interrupted.opening is not None
        self._descriptor = descriptor
        self._ours = ours
        self._failed: OutputError | None = None

    @classmethod
    def create(cls, path: Path) -> Self:
        """Create a journal; an existing file is never overwritten.

        Raises:
            OutputError: it cannot be written, or is not empty.
            InUseError: another process is writing it.
        """
        existed = os.path.lexists(path)
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | _APPEND, 0o600)
        except (OSError, ValueError) as error:
            raise OutputError(f"cannot write {path}: {why(error)}") from error
        try:
            lock(descriptor, path)
            _check_empty(descriptor, path)
        except BaseException:
            os.close(descriptor)
            raise
        return cls(descriptor, path, None, ours=not existed)

    @classmethod
    def reopen(cls, path: Path) -> Self:
        """Open the journal of an interrupted run to resume it; a torn last line is cut off.

        Raises:
            BadInputFileError: it is not a journal.
            InUseError: another process is writing it.
            OutputError: it cannot be written.
        """
        try:
            descriptor = os.open(path, os.O_RDWR | _APPEND)
        except (FileNotFoundError, IsADirectoryError, ValueError) as error:
            raise BadInputFileError(f"{path}: {why(error)}", "see: sphero-probe runs") from error
        except OSError as error:
            raise OutputError(f"cannot write {path}: {why(error)}") from error
        try:
            lock(descriptor, path)
            check_size(descriptor, path)
            with ExitStack() as opened:
                interrupted = InterruptedRun(opened.enter_context(os.fdopen(os.dup(descriptor), "rb")), path)
                journal = cls(descriptor, path, interrupted, ours=False)
                journal._repair_end(interrupted)
                opened.pop_all()
        except BaseException:
            os.close(descriptor)
            raise
        return journal

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close and unlock the file; delete it if this journal created it and it is still empty."""
        if self.interrupted:
            self.interrupted.close()
        empty = not os.fstat(self._descriptor).st_size
        os.close(self._descriptor)
        if self._ours and empty:
            self.path.unlink(missing_ok=True)

    def open(self, opening: Opening) -> None:
        """Write the first line.

        Raises:
            OutputError: it cannot be written.
        """
        self._write(encode(opening))
        self.resumable = True

    def append(self, lines: bytes) -> None:
        """Write whole lines of this run that another process has made.

        Raises:
            OutputError: they cannot be written.
        """
        self._write(lines)
        self.resumable = True

    def intend(self, probe: PreparedProbe) -> None:
        """Write that a probe is about to be sent.

        Raises:
            OutputError: it cannot be written. The probe must not be sent.
        """
        self._write(encode_intent(probe.number, probe.command, probe.risk))

    def record(self, record: Record) -> None:
        """Write what the run found.

        Raises:
            OutputError: it cannot be written.
            BadInputFileError: the heading is of another robot than the run so far.
        """
        if isinstance(record, Finding):
            self._write(encode_finding(record))
            return
        earlier = self.interrupted.headings if self.interrupted else ()
        if isinstance(record, Heading):
            for heading in earlier:
                check_same_robot(heading, record, self.path)
        self._write(encode(record, resumed=bool(earlier)))

    def _write(self, line: bytes) -> None:
        if self._failed:
            raise self._failed
        try:
            written = os.write(self._descriptor, line)
        except OSError as error:
            self._failed = OutputError(f"cannot write {self.path}: {why(error)}", "is the disk full?")
            raise self._failed from error
        if written != len(line):  # the last line is torn: nothing may follow it
            self._failed = OutputError(
                f"cannot write {self.path}: no room for a whole line", "is the disk full?"
            )
            raise self._failed

    def _repair_end(self, interrupted: InterruptedRun) -> None:
        """Cut off a torn last line, or end it."""
        if not interrupted.is_torn:
            return
        try:
            os.ftruncate(self._descriptor, interrupted.valid_bytes)
            if interrupted.valid_bytes:
                os.lseek(self._descriptor, interrupted.valid_bytes - 1, os.SEEK_SET)
                if os.read(self._descriptor, 1) != b"\n":
                    os.write(self._descriptor, b"\n")
        except OSError as error:
            raise OutputError(f"cannot write {self.path}: {why(error)}") from error


def check_same_robot(earlier: Heading | Opening, now: Heading | Opening, path: Path) -> None:
    """Compare model, name and the firmware of the nodes that both have.

    Raises:
        BadInputFileError: they differ.
    """
    if changed := difference(_identity_of(earlier), _identity_of(now)):
        raise BadInputFileError(f"{path}: the journal of another robot or firmware: {changed}")


def _identity_of(entry: Heading | Opening) -> Identity:
    return Identity(entry.robot, entry.device, entry.firmware if isinstance(entry, Heading) else {})


def _check_empty(descriptor: int, path: Path) -> None:
    if os.fstat(descriptor).st_size:
        raise OutputError(
            f"cannot write {path}: the file is not empty", "resume it with --resume, or name a new file"
        )
