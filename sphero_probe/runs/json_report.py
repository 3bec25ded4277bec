"""Read a report in JSON, which may come from a stranger, and return the records of its run.

Every field that is used is checked as in a journal. The command is read from the frame that was sent and the
answer from the frame that was received; names come from the catalogue, not from the file.
"""

import re
from pathlib import Path
from typing import Final

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.catalogue.meaning import answer_meaning
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.json_files import JsonObjects, open_regular
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.probing.finding import Finding, Note, Record
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Request, Role
from sphero_probe.runs.decode import (
    CONFIDENCES,
    MAX_NUMBER,
    MAX_TEXT,
    MAX_WORD,
    OUTCOMES,
    heading_of,
    response_of,
    summary_of,
)
from sphero_probe.runs.fields import Fields

_MAX_FILE: Final = 1 << 28
"""Bytes of a report."""
_START: Final = re.compile(rb'\s*(\[|\{\s*"type"\s*:\s*"(run|finding|note|summary)")')


def is_json_report(path: Path) -> bool:
    """Whether a file starts like a report in JSON; False if it cannot be read."""
    try:
        with open_regular(path) as file:
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
    with open_regular(path, most=_MAX_FILE) as file:
        objects = JsonObjects(file, path)
        for data in objects:
            try:
                records.append(reader.record(data))
            except BadLineError as error:
                raise objects.bad(error) from error
    last = {record.number: record for record in records if isinstance(record, Finding)}
    by_number = iter(sorted(last.values(), key=lambda finding: finding.number))
    kept = (one for one in records if not isinstance(one, Finding) or last[one.number] is one)
    return [next(by_number) if isinstance(record, Finding) else record for record in kept]


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
            fields.whole("number", 1, MAX_NUMBER),
            exchange.command._replace(target=target),
            fields.one_of("outcome", OUTCOMES),
            fields.one_of("confidence", CONFIDENCES),
            risk,
            exchange,
            known,
            name,
            fields.whole("attempts", 0, MAX_NUMBER),
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
    response = response_of(received, CODECS[generation])
    seconds = fields.seconds("rtt_ms") / 1000
    return Answered(request.command, request.seq, sent, response, received, seconds)
