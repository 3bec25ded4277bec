"""Read a report in JSON, which may come from a stranger, and return the records of its run.

Every field that is used is checked as in a journal. The command is read from the frame that was sent and the
answer from the frame that was received; names come from the catalogue, not from the file.
"""

import json
import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.catalogue.meaning import answer_meaning
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.probing.finding import Confidence, Finding, Note, Outcome, Record
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Request, Response, Role
from sphero_probe.runs.decode import MAX_LINE, MAX_TEXT, MAX_WORD, heading_of, summary_of
from sphero_probe.runs.fields import Fields, parse
from sphero_probe.runs.reader import FLAGS, why

_MAX_FILE: Final = 1 << 28
"""Bytes of a report."""
_MAX_WHOLE: Final = 1 << 26
"""Bytes of a report that is parsed at once, because it does not have one object per line."""
_START: Final = re.compile(rb'\s*(\[|\{\s*"type"\s*:\s*"(run|finding|note|summary)")')
_NUMBERS: Final = 1 << 31
_OUTCOMES: Final = {word.value: word for word in Outcome}
_CONFIDENCES: Final = {word.value: word for word in Confidence}


def is_json_report(path: Path) -> bool:
    """Whether a file starts like a report in JSON; False if it cannot be read."""
    try:
        with _opened(path) as file:
            return bool(_START.match(file.read(256)))
    except (BadInputFileError, OSError):
        return False


def read_json_report(path: Path) -> list[Record]:
    """Return the records of a report that was written with the format ``json`` or ``jsonl``.

    Findings are in the order of their numbers, and only the last of each number is kept, as in a journal.

    Raises:
        BadInputFileError: it cannot be read, or is not a report of a run; the message names the line or the
            number of the object.
    """
    records: list[Record] = []
    reader = _Reader()
    try:
        with _opened(path) as file:
            for where, data in _objects(file):
                try:
                    records.append(reader.record(data))
                except BadLineError as error:
                    raise BadInputFileError(f"{path}:{where}: {error}") from error
    except OSError as error:
        raise BadInputFileError(f"{path}: {why(error)}") from error
    except BadLineError as error:
        raise BadInputFileError(f"{path}: {error}") from error
    last = {record.number: record for record in records if isinstance(record, Finding)}
    by_number = iter(sorted(last.values(), key=lambda finding: finding.number))
    kept = (one for one in records if not isinstance(one, Finding) or last[one.number] is one)
    return [next(by_number) if isinstance(record, Finding) else record for record in kept]


def _opened(path: Path) -> BinaryIO:
    """Open a regular file of limited size.

    Raises:
        BadInputFileError: it is not one, or cannot be opened.
    """
    try:
        file = os.fdopen(os.open(path, os.O_RDONLY | FLAGS), "rb")
    except (OSError, ValueError) as error:
        raise BadInputFileError(f"{path}: {why(error)}") from error
    status = os.fstat(file.fileno())
    if stat.S_ISREG(status.st_mode) and status.st_size <= _MAX_FILE:
        return file
    file.close()
    if not stat.S_ISREG(status.st_mode):
        raise BadInputFileError(f"{path}: not a regular file")
    raise BadInputFileError(f"{path}: larger than {_MAX_FILE} bytes: not a report")


def _objects(file: BinaryIO) -> Iterator[tuple[int, dict[str, object]]]:
    """Yield the objects with their line, or with their number where they do not have a line each.

    Raises:
        BadLineError: this is not JSON, or not a list of objects.
    """
    number = 0
    while line := file.readline(MAX_LINE + 1):
        number += 1
        text = line.strip().removesuffix(b",")
        if text in (b"", b"[", b"]"):
            continue
        try:
            yield number, parse(text)
        except BadLineError:
            if number > 2:
                raise BadLineError(f"line {number} is not a JSON object") from None
            break
    else:
        return
    file.seek(0)
    yield from enumerate(_whole(file), 1)


def _whole(file: BinaryIO) -> list[dict[str, object]]:
    """Return the objects of an array that another program has formatted."""
    if os.fstat(file.fileno()).st_size > _MAX_WHOLE:
        raise BadLineError("not one object per line, and too large to be read at once")
    try:
        held = json.loads(file.read().decode("utf-8", "surrogatepass"))
    except (ValueError, RecursionError) as error:
        raise BadLineError("not valid JSON") from error
    if not isinstance(held, list) or not all(isinstance(one, dict) for one in held):
        raise BadLineError("not a list of JSON objects")
    return held


class _Reader:
    """Turns objects into records; the run's object says which protocol the following ones speak."""

    def __init__(self) -> None:
        self._robot = ""

    def record(self, data: dict[str, object]) -> Record:
        """Return the record of an object.

        Raises:
            BadLineError: a field is missing, of a wrong type or out of range.
        """
        fields = Fields(data)
        match data.get("type"):
            case "run":
                heading = heading_of(fields)
                self._robot = heading.robot
                return heading
            case "finding":
                return self._finding(fields)
            case "note":
                details = {
                    key: value
                    for key, value in data.items()
                    if key not in ("type", "kind", "text", "schema_version")
                }
                text = fields.text("text", MAX_TEXT)
                return Note(fields.text("kind", MAX_WORD), text, Fields({"data": details}).details("data"))
            case "summary":
                return summary_of(fields)
            case _:
                raise BadLineError("not an object of a run")

    def _finding(self, fields: Fields) -> Finding:
        did, cid, target = fields.byte("did"), fields.byte("cid"), fields.byte_or_none("target")
        risk, note = fields.risk("risk"), fields.text("note", MAX_TEXT)
        sent = fields.raw("sent") if fields.given("sent") else b""
        generation = self._generation(sent)
        exchange: Exchange
        if sent:
            exchange = _exchange(fields, generation, sent, (did, cid))
        else:
            payload = fields.raw("request") if fields.given("request") else b""
            exchange = Blocked(Command(did, cid, payload, target), risk, note)
        known = lookup(generation, did, cid, ROBOTS.get(self._robot))
        name = ""
        if isinstance(exchange, Answered):
            name = CODECS[generation].code_name(exchange.response.code)
            problem = answer_meaning(exchange.response, known).problem
            note = note.removesuffix(problem).removesuffix("; ") if problem else note
        return Finding(
            fields.whole("number", 1, _NUMBERS),
            exchange.command._replace(target=target),
            fields.one_of("outcome", _OUTCOMES),
            fields.one_of("confidence", _CONFIDENCES),
            risk,
            exchange,
            known,
            name,
            fields.whole("attempts", 0, _NUMBERS),
            note,
        )

    def _generation(self, sent: bytes) -> Generation:
        """Return the protocol of the robot, or for an unknown one that of the frame."""
        robot = ROBOTS.get(self._robot)
        if robot:
            return robot.generation
        fitting = (one for one in Generation if sent and _request(one, sent))
        return next(fitting, Generation.V2)


def _request(generation: Generation, sent: bytes) -> Request | None:
    packets = CODECS[generation].decoder(Role.ROBOT).feed(sent)
    return packets[0] if len(packets) == 1 and isinstance(packets[0], Request) else None


def _exchange(fields: Fields, generation: Generation, sent: bytes, pair: tuple[int, int]) -> Exchange:
    request = _request(generation, sent)
    if request is None or request.command[:2] != pair:
        raise BadLineError("sent is not this command")
    if not fields.given("received"):
        return Silent(request.command, request.seq, sent, 0.0)
    received = fields.raw("received")
    packets = CODECS[generation].decoder(Role.HOST).feed(received)
    if len(packets) != 1 or not isinstance(packets[0], Response):
        raise BadLineError("received is not one response")
    seconds = fields.seconds("rtt_ms") / 1000
    return Answered(request.command, request.seq, sent, packets[0], received, seconds)
