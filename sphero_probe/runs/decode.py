"""Turn the JSON object of a journal line into a checked entry.

A journal may come from a stranger. The type and range of every field are checked. Nothing in a line is
imported, opened as a file, or executed.
"""

import hashlib
from collections.abc import Collection
from typing import Final, NamedTuple

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadInputFileError, BadLineError
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.probing.plan import Plan
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import USUAL, Command, Generation, Response, Role, SendOptions
from sphero_probe.runs.fields import Fields

SCHEMA_VERSION: Final = 1
MAX_TEXT: Final = 1 << 16
"""Characters of a text for the user."""
MAX_WORD: Final = 512
"""Characters of a name."""
MAX_NUMBER: Final = 1 << 31
"""Of a probe, and of what is counted."""
_GENERATIONS: Final = {word.value: word for word in Generation}
_ROBOTS: Final = {key: key for key in ("", *ROBOTS)}
OUTCOMES: Final = {word.value: word for word in Outcome}
CONFIDENCES: Final = {word.value: word for word in Confidence}
_EXCHANGES: Final = {word: word for word in ("answered", "silent", "refused")}


class Opening(NamedTuple):
    """The first line of a journal: what the run was asked to do.

    Attributes:
        command: the command of the tool: ``sweep``, ``discover``, ``send``, ``led``.
        plan: the plan's name.
        digest: of the plan, see ``digest_of``.
        options: the options that select what to send, without dashes: ``{"did": "0x13"}``.
        target: the node as it was typed, empty for the robot's usual one.
        address: the robot's device address.
        generation: the protocol it speaks.
        robot: the model's key, empty if it is not known.
        device: the robot's name.
        consent: the allowed risk classes, by name.
    """

    command: str
    plan: str
    digest: str
    options: dict[str, str]
    target: str
    address: str
    generation: Generation
    robot: str
    device: str
    consent: tuple[str, ...]


class Intent(NamedTuple):
    """A probe that was about to be sent.

    Attributes:
        number: its place in the run, from 1.
        command: with node and payload.
        risk: the class of sending it.
    """

    number: int
    command: Command
    risk: Risk


Entry = Opening | Intent | Record


def digest_of(plan: Plan) -> str:
    """Return a hash that identifies a plan: of its file, or of its probes.

    Raises:
        BadInputFileError: the plan's file cannot be read.
    """
    if plan.file:
        try:
            return hashlib.sha256(plan.file.read_bytes()).hexdigest()
        except OSError as error:
            raise BadInputFileError(f"{plan.file}: {error.strerror}") from error
    made = hashlib.sha256(plan.name.encode("utf-8", "surrogatepass"))
    for stage in plan.stages:
        made.update(b"\nstage")
        if isinstance(stage, Collection):
            for command, exact in stage:
                made.update(f"\n{command.did} {command.cid} {command.target} {exact} ".encode())
                made.update(command.payload.hex().encode())
    return made.hexdigest()


def decode(data: dict[str, object], opening: Opening | None) -> Entry:
    """Return the entry of a journal line.

    Args:
        data: what ``parse`` returned.
        opening: the journal's first line; None to decode that one.

    Raises:
        BadLineError: a field is missing, of a wrong type or out of range, or the line is not allowed here.
    """
    fields = Fields(data)
    kind = data.get("type")
    if opening is None:
        if kind != "journal":
            raise BadLineError("does not start like a journal")
        return _opening(fields)
    match kind:
        case "run":
            fields.flag("resumed")
            return heading_of(fields)
        case "intent":
            return Intent(fields.whole("number", 1, MAX_NUMBER), _command(fields), fields.risk("risk"))
        case "finding":
            return _finding(fields, opening)
        case "note":
            return Note(fields.text("kind", MAX_WORD), fields.text("text", MAX_TEXT), fields.details("data"))
        case "summary":
            return summary_of(fields)
        case _:
            raise BadLineError("an unknown type of line")


def _opening(fields: Fields) -> Opening:
    if fields.whole("schema_version", 0, MAX_NUMBER) != SCHEMA_VERSION:
        raise BadLineError(f"a journal of another version; this tool reads {SCHEMA_VERSION}")
    return Opening(
        fields.text("command", MAX_WORD),
        fields.text("plan", MAX_WORD),
        fields.text("digest", MAX_WORD),
        fields.texts("options"),
        fields.text("target", MAX_WORD),
        fields.text("address", MAX_TEXT),
        fields.one_of("generation", _GENERATIONS),
        fields.one_of("robot", _ROBOTS),
        fields.text("device", MAX_TEXT),
        fields.risks("consent"),
    )


def heading_of(fields: Fields) -> Heading:
    """Return the start of a run.

    Raises:
        BadLineError: a field is missing, of a wrong type or out of range.
    """
    return Heading(
        fields.one_of("robot", _ROBOTS),
        fields.text("model", MAX_WORD),
        fields.text("device", MAX_TEXT),
        fields.texts("firmware"),
        fields.text("plan", MAX_WORD),
        fields.text("tool_version", MAX_WORD),
        fields.risks("consent"),
        fields.texts("strictness"),
        fields.text("started", MAX_WORD),
        fields.text("line", MAX_WORD) if fields.has("line") else "",
        fields.byte_or_none("client"),
    )


def _command(fields: Fields) -> Command:
    ids, payload, target = (fields.byte("did"), fields.byte("cid")), fields.raw("payload"), "target"
    options = _send_options(fields.inner("options")) if fields.has("options") else USUAL
    return Command(*ids, payload, fields.byte_or_none(target), options)


def _send_options(fields: Fields) -> SendOptions:
    """Return the flags that a command was sent with; only unusual ones are written."""
    return SendOptions(
        fields.flag("answer"),
        fields.flag("only_errors"),
        fields.flag("activity"),
        fields.byte_or_none("source"),
        fields.flag("without_source"),
    )


def _finding(fields: Fields, opening: Opening) -> Finding:
    command, risk = _command(fields), fields.risk("risk")
    codec = CODECS[opening.generation]
    exchange = _exchange(fields, command, risk, opening.generation)
    return Finding(
        fields.whole("number", 1, MAX_NUMBER),
        command,
        fields.one_of("outcome", OUTCOMES),
        fields.one_of("confidence", CONFIDENCES),
        risk,
        exchange,
        lookup(opening.generation, command.did, command.cid, ROBOTS.get(opening.robot)),
        codec.code_name(exchange.response.code) if isinstance(exchange, Answered) else "",
        fields.whole("attempts", 0, MAX_NUMBER),
        fields.text("note", MAX_TEXT),
    )


def _exchange(fields: Fields, command: Command, risk: Risk, generation: Generation) -> Exchange:
    kind = fields.one_of("exchange", _EXCHANGES)
    if kind == "refused":
        return Blocked(command, risk, fields.text("reason", MAX_TEXT))
    seq, sent, seconds = fields.byte("seq"), fields.raw("sent"), fields.seconds("seconds")
    if kind == "silent":
        return Silent(command, seq, sent, seconds)
    received = fields.raw("received")
    response = response_of(received, CODECS[generation])
    return Answered(command, seq, sent, response, received, seconds)


def response_of(received: bytes, codec: Codec) -> Response:
    """Return the response that a frame holds.

    Raises:
        BadLineError: it is not one response.
    """
    packets = codec.decoder(Role.HOST).feed(received)
    if len(packets) != 1 or not isinstance(packets[0], Response):
        raise BadLineError("received is not one response")
    return packets[0]


def summary_of(fields: Fields) -> Summary:
    """Return the end of a run; in journals of version 0.1.0 ``probes_sent`` counted frames.

    Raises:
        BadLineError: a field is missing, of a wrong type or out of range.
    """
    counts = {Outcome(word): count for word, count in fields.counts("counts", tuple(Outcome)).items()}
    probes = fields.whole("probes_sent", 0, MAX_NUMBER)
    frames = fields.whole("frames_sent", 0, MAX_NUMBER) if fields.has("frames_sent") else None
    if frames is None:
        probes, frames = sum(counts.values()) - counts.get(Outcome.SKIPPED, 0), probes
    strictness = fields.texts("strictness") if fields.has("strictness") else {}
    return Summary(counts, fields.seconds("seconds"), probes, frames, fields.flag("complete"), strictness)
