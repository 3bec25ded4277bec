"""Read a file as a side of a comparison: a journal, or a JSON report as ``-o FILE`` writes it.

The file may come from a stranger: its size is bounded, and type and range of every field are checked.
"""

from pathlib import Path
from typing import BinaryIO, Final

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import MAX_LINE, JsonObjects, open_regular, parse
from sphero_probe.probing.finding import Confidence, Heading, Summary
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.autodetect import AutoDecoder
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Generation, Request, Role
from sphero_probe.runs.decode import (
    MAX_NUMBER,
    MAX_TEXT,
    MAX_WORD,
    OUTCOMES,
    Opening,
    decode,
    response_of,
)
from sphero_probe.runs.fields import Fields
from sphero_probe.runs.reader import MAX_FILE
from sphero_probe.runs.sides import Observation, Side, run_side

_CERTAIN: Final = {word.value: word is Confidence.CERTAIN for word in Confidence}
_OTHER_TYPES: Final = frozenset(("note", "diff", "difference", "uncertain", "diff_summary"))
"""Objects of a report that say nothing about one command; a comparison with a baseline adds some."""
_HINT: Final = "it takes a journal, or a report of a run in JSON: -o FILE.json"
_JOURNAL: Final = b'{"type":"journal",'
_INTENT: Final = b'{"type":"intent",'


def file_side(path: Path, source: str) -> Side:
    """Return the run that a journal or a JSON report holds.

    Args:
        path: the file.
        source: as the user named it.

    Raises:
        BadInputFileError: it cannot be read, or holds no run; the message names the line or object.
    """
    with open_regular(path, "see: sphero-probe runs", MAX_FILE) as file:
        is_journal = file.read(len(_JOURNAL)) == _JOURNAL
        file.seek(0)
        return (_journal_side if is_journal else _report_side)(file, path, source)


def _journal_side(file: BinaryIO, path: Path, source: str) -> Side:
    """Return the run of a journal; a torn last line is skipped, as ``reader`` does."""
    journal = _Journal()
    number = 0
    while line := file.readline(MAX_LINE + 1):
        number += 1
        if line.startswith(_INTENT):
            continue  # half of the lines, and they tell nothing about the robot
        try:
            data = parse(line)
        except BadLineError as error:
            if file.read(1):
                raise BadInputFileError(f"{path}:{number}: {error}") from error
            break
        try:
            journal.add(data)
        except BadLineError as error:
            raise BadInputFileError(f"{path}:{number}: {error}") from error
    if journal.opening is None:
        raise BadInputFileError(f"{path}: this journal is still empty")
    heading = journal.heading or _heading_of(journal.opening)
    codec = CODECS[journal.opening.generation]
    return run_side(source, "run", codec, heading, journal.found.values(), complete=journal.complete)


class _Journal:
    """Collects what the lines of a journal tell; a finding is read directly, as there are so many.

    Attributes:
        opening: the first line, None before it was seen.
        heading: of the run, None before it was seen.
        found: number of a probe -> what it tells; a later line replaces what it verified.
        complete: whether the run asked everything that it should.
    """

    def __init__(self) -> None:
        self.opening: Opening | None = None
        self.heading: Heading | None = None
        self.found: dict[int, Observation] = {}
        self.complete = False
        self._names: dict[tuple[int, int], str | None] = {}

    def add(self, data: dict[str, object]) -> None:
        """Take the next line.

        Raises:
            BadLineError: it is no line of a journal.
        """
        if self.opening and data.get("type") == "finding":
            fields = Fields(data)
            number = fields.whole("number", 1, MAX_NUMBER)
            self.found[number] = self._observation(fields, self.opening)
            return
        match decode(data, self.opening):
            case Opening() as opening:
                self.opening = opening
            case Heading() as heading:
                self.heading, self.complete = heading, False
            case Summary() as summary:
                self.complete = summary.complete

    def _observation(self, fields: Fields, opening: Opening) -> Observation:
        did, cid = fields.byte("did"), fields.byte("cid")
        if (did, cid) not in self._names:
            row = lookup(opening.generation, did, cid, ROBOTS.get(opening.robot))
            self._names[did, cid] = row.name if row else None
        name, codec = self._names[did, cid], CODECS[opening.generation]
        received = fields.raw("received") if fields.has("received") else None
        return _observation(fields, did, cid, fields.raw("payload"), received, name, codec)


def _heading_of(opening: Opening) -> Heading:
    """Return what is known of a run that has no heading: that of a single command, or a cut one."""
    model = ROBOTS[opening.robot].name if opening.robot in ROBOTS else ""
    consent = opening.consent
    return Heading(opening.robot, model, opening.device, {}, opening.plan, "", consent, {}, "")


def _report_side(file: BinaryIO, path: Path, source: str) -> Side:
    report = _Report()
    objects = JsonObjects(file, path)
    is_empty = True
    for data in objects:
        is_empty = False
        try:
            report.add(data)
        except BadLineError as error:
            raise objects.bad(error, _HINT) from error
    if is_empty:
        raise BadInputFileError(f"{path}: this file is empty")
    codec = report.codec or CODECS[Generation.V2]
    found = report.found.values()
    return run_side(source, "report", codec, report.heading, found, complete=report.complete)


class _Report:
    """Collects the objects of a JSON report.

    Attributes:
        heading: of the run, None before it was seen.
        found: number of a probe -> what it tells; a later object replaces what it verified.
        complete: whether the run asked everything that it should.
        codec: of the robot's protocol, None before a robot or a frame was seen.
    """

    def __init__(self) -> None:
        self.heading: Heading | None = None
        self.found: dict[int, Observation] = {}
        self.complete = False
        self.codec: Codec | None = None

    def add(self, data: dict[str, object]) -> None:
        """Take the next object.

        Raises:
            BadLineError: it is no object of a run's report.
        """
        fields = Fields(data)
        match data.get("type"):
            case "finding":
                self.found[fields.whole("number", 1, MAX_NUMBER)] = self._observation(fields)
            case "run":
                self.heading = _heading(fields)
                if robot := ROBOTS.get(self.heading.robot):
                    self.codec = CODECS[robot.generation]
            case "summary":
                self.complete = fields.flag("complete")
            case kind if kind not in _OTHER_TYPES:
                raise BadLineError("not an object of a run's report")

    def _observation(self, fields: Fields) -> Observation:
        sent, received = fields.raw_or_none("sent"), fields.raw_or_none("received")
        codec = self.codec = self.codec or _codec_of(sent or received or b"")
        request = fields.raw_or_none("request") or b""
        if sent and not fields.has("request"):  # reports of version 0.1.0 do not have it
            packets = codec.decoder(Role.ROBOT).feed(sent)
            if len(packets) != 1 or not isinstance(packets[0], Request):
                raise BadLineError("sent is not one command")
            request = packets[0].command.payload
        name = fields.text_or_none("name", MAX_WORD)
        return _observation(fields, fields.byte("did"), fields.byte("cid"), request, received, name, codec)


def _observation(
    fields: Fields,
    did: int,
    cid: int,
    request: bytes,
    received: bytes | None,
    name: str | None,
    codec: Codec,
) -> Observation:
    return Observation(
        fields.byte_or_none("target"),
        did,
        cid,
        request,
        fields.one_of("outcome", OUTCOMES),
        fields.one_of("confidence", _CERTAIN),
        fields.risk("risk"),
        response_of(received, codec) if received else None,
        name,
        fields.text("note", MAX_TEXT),
    )


def _codec_of(frame: bytes) -> Codec:
    """Return the codec that reads a frame; that of most robots where none does."""
    decoder = AutoDecoder()
    found = decoder.feed(frame) + decoder.end()
    return CODECS[found[0].generation if found else Generation.V2]


def _heading(fields: Fields) -> Heading:
    robot, model, device = (fields.text(key, MAX_TEXT) for key in ("robot", "model", "device"))
    plan, version, started = (fields.text(key, MAX_TEXT) for key in ("plan", "tool_version", "started"))
    return Heading(robot, model, device, fields.texts("firmware"), plan, version, (), {}, started)
