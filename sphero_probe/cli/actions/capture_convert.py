"""``capture convert``: the robots of a capture, or what a run kept, in a pcapng file."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from sphero_probe import __version__
from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.pcapng_out import PcapngWriter
from sphero_probe.captures.record import Record
from sphero_probe.captures.synthetic import BleScript, Script, SerialScript
from sphero_probe.cli.capture_comments import comment_of_finding, comment_of_probe
from sphero_probe.cli.capture_out import NO_ADDRESS, script_of
from sphero_probe.cli.captured import capture_in
from sphero_probe.cli.messages import say
from sphero_probe.errors import BadInputFileError, OutputError, UsageError
from sphero_probe.link.exchange import Answered, Silent
from sphero_probe.probing.finding import Finding, Note
from sphero_probe.runs.reader import Recorded, read_journal
from sphero_probe.runs.store import LAST, find_journal

_MAX_SCRIPTS: Final = 1 << 12
_JOURNAL: Final = b'{"type":"journal"'


def convert(source: str, target: str) -> None:
    """Write the packets of all robots.

    Args:
        source: a capture, or a run: its journal, its name, or ``last``.
        target: the file to write.

    Raises:
        UsageError: the two are the same file.
        BadInputFileError: there is no such file or run, or nothing in it can be read.
        OutputError: the file cannot be written.
    """
    path = Path(source)
    if path.is_file() and not _is_journal(path):
        _convert_capture(source, target)
    else:
        _convert_run(read_journal(_journal_named(source)), target)


def _journal_named(source: str) -> Path:
    try:
        return find_journal(source)
    except BadInputFileError as error:
        if source == LAST:
            raise
        raise BadInputFileError(f"{source}: no such file or run", error.hint) from error


def _is_journal(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(_JOURNAL)) == _JOURNAL
    except OSError as error:
        raise BadInputFileError(f"{path}: {error.strerror}") from error


class _File:
    """The pcapng file that is written."""

    def __init__(self, path: Path, target: str) -> None:
        if Path(target).exists() and path.exists() and Path(target).samefile(path):
            raise UsageError(f"{target} is the input itself", "give -o another name")
        self._writer = PcapngWriter(f"sphero-probe {__version__}")
        self._target = target

    @contextmanager
    def open(self) -> Iterator["_File"]:
        """Open it, and begin it."""
        try:
            with Path(self._target).open("wb") as self._file:
                self._file.write(self._writer.start())
                yield self
        except OSError as error:
            raise OutputError(f"cannot write {self._target}: {error.strerror}") from error

    def write(self, records: Iterator[Record], *comments: str) -> None:
        """Write some records, the last of them with comments."""
        listed = list(records)
        for place, record in enumerate(listed, 1):
            self._file.write(self._writer.packet(record, comments if place == len(listed) else ()))


def _convert_capture(source: str, target: str) -> None:
    scripts: dict[int, Script] = {}
    left_out = 0
    with capture_in(source) as capture, _File(Path(source), target).open() as file:
        for captured in capture.packets():
            time, to_robot = captured.time or 0, captured.to_robot
            number = captured.connection.number
            script = scripts.get(number)
            if to_robot is None or (script is None and len(scripts) >= _MAX_SCRIPTS):
                left_out += 1
                continue
            if script is None:
                script = scripts[number] = _script(captured)
                file.write(script.opening(time))
            file.write((script.sent if to_robot else script.received)(time, captured.raw))
    say(f"{source}: {capture.said}")
    if left_out:
        say(f"Left out: {left_out} packets whose direction the capture does not tell.")


def _script(captured: CapturedPacket) -> Script:
    number, peer, name = captured.connection
    if captured.handle is None:
        return SerialScript(number)
    return BleScript(captured.generation, peer or NO_ADDRESS, name or f"robot {number}", number)


def _convert_run(run: Recorded, target: str) -> None:
    """Write the frames that a journal holds; it has round trips, but not the moments at which they began."""
    if run.opening is None or not run.headings:
        raise BadInputFileError(f"{run.path}: this journal is still empty")
    script = script_of(run.opening.generation, run.opening.address, run.headings[0].device)
    now = _nanoseconds(run.headings[0].started)
    count = 0
    with _File(run.path, target).open() as file:
        file.write(script.opening(now))
        for entry in run.entries:
            match entry:
                case Finding(exchange=Answered() | Silent() as exchange, number=number, command=command):
                    if run.findings[number] is not entry:
                        continue  # a later finding of the same probe replaces it
                    said = [comment_of_probe(number, command, entry.name), comment_of_finding(entry)]
                    file.write(script.sent(now, exchange.sent), *said)
                    took = exchange.rtt if isinstance(exchange, Answered) else exchange.waited
                    now += int(took * 1_000_000_000)
                    if isinstance(exchange, Answered):
                        file.write(script.received(now, exchange.received), said[1])
                    count += 1
                case Note(data=data) if frame := _frame(data.get("raw")):
                    file.write(script.received(now, frame), entry.text)
    say(f"{run.path}: {count} exchanges of {run.headings[0].device}")
    say("A run keeps round trips, not the moments between them: in the file, one probe follows the other.")


def _frame(raw: object) -> bytes:
    try:
        return bytes.fromhex(raw) if isinstance(raw, str) else b""
    except ValueError:
        return b""


def _nanoseconds(started: str) -> int:
    try:
        moment = datetime.fromisoformat(started)
    except ValueError:
        return 0
    return int((moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()) * 1_000_000_000
