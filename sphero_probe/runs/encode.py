"""Turn entries into journal lines, which ``decode`` reads.

A sweep writes two lines per probe. So intents and findings are formatted with a template, which is fast; only
texts that may need escaping pass through the JSON encoder.
"""

import json
import math
from json.encoder import encode_basestring_ascii
from typing import Final, assert_never

from sphero_probe.catalogue.risk import Risk
from sphero_probe.json_files import MAX_LINE
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.probing.finding import Finding, Heading, Note, Summary
from sphero_probe.protocol.packets import USUAL, Command
from sphero_probe.runs.decode import (
    MAX_TEXT,
    MAX_WORD,
    SCHEMA_VERSION,
    Entry,
    Intent,
    Opening,
)

_RISKS: Final = tuple(risk.word for risk in sorted(Risk))
_JSON: Final = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode


def encode(entry: Entry, *, resumed: bool = False) -> bytes:
    """Return an entry as one line of ASCII, with its end.

    Args:
        entry: what to write.
        resumed: for a heading: the run resumes an interrupted one.
    """
    match entry:
        case Finding():
            return encode_finding(entry)
        case Intent(number=number, command=command, risk=risk):
            return encode_intent(number, command, risk)
        case Note():
            return _note(entry)
        case Opening():
            held = entry._replace(plan=entry.plan[:MAX_WORD])
            return _line({"type": "journal", "schema_version": SCHEMA_VERSION} | held._asdict())
        case Heading():
            shortened = entry._replace(plan=entry.plan[:MAX_WORD])
            return _line({"type": "run", "resumed": resumed} | shortened._asdict())
        case Summary():
            ending: dict[str, object] = {"type": "summary"}
            return _line(ending | entry._asdict() | {"strictness": dict(entry.strictness)})
    assert_never(entry)


def encode_intent(number: int, command: Command, risk: Risk) -> bytes:
    """Return the line of a probe that is about to be sent; the arguments are the fields of ``Intent``."""
    return (f'{{"type":"intent","number":{number},{_command(command)},"risk":"{_RISKS[risk]}"}}\n').encode(
        "ascii"
    )


def encode_finding(finding: Finding) -> bytes:
    """Return the line of a finding."""
    number, command, outcome, confidence, risk, exchange, _, _, attempts, note = finding
    return (
        f'{{"type":"finding","number":{number},{_command(command)},"outcome":"{outcome}",'
        f'"confidence":"{confidence}","risk":"{_RISKS[risk]}","attempts":{attempts},'
        f'"note":{encode_basestring_ascii(note)},{_exchange(exchange)}}}\n'
    ).encode("ascii")


def _command(command: Command) -> str:
    did, cid, payload, target, options = command
    node = "null" if target is None else target
    told = f'"target":{node},"did":{did},"cid":{cid},"payload":"{payload.hex()}"'
    return told if options is USUAL or options == USUAL else f'{told},"options":{_JSON(options._asdict())}'


def _exchange(exchange: Exchange) -> str:
    match exchange:
        case Answered(_, seq, sent, _, received, rtt):
            return (
                f'"exchange":"answered","seq":{seq},"sent":"{sent.hex()}",'
                f'"received":"{received.hex()}","seconds":{rtt}'
            )
        case Silent(_, seq, sent, waited):
            return f'"exchange":"silent","seq":{seq},"sent":"{sent.hex()}","seconds":{waited}'
        case Blocked(reason=reason):
            return f'"exchange":"refused","reason":{encode_basestring_ascii(reason)}'
    assert_never(exchange)


def _note(note: Note) -> bytes:
    """Return the line of a note; one that is too long loses its details."""
    line = _line(_note_data(note.kind, note.text[:MAX_TEXT], note.data))
    if len(line) > MAX_LINE:
        return _line(_note_data(note.kind, note.text[:MAX_WORD], {}))
    return line


def _note_data(kind: str, text: str, data: dict[str, object]) -> dict[str, object]:
    return {"type": "note", "kind": kind, "text": text, "data": _writable(data)}


def _line(data: dict[str, object]) -> bytes:
    return (_JSON(data) + "\n").encode("ascii")


def _writable(value: object) -> object:
    """Return a value with floats that JSON cannot hold, such as NaN, turned into texts."""
    match value:
        case float():
            return value if math.isfinite(value) else str(value)
        case dict():
            return {str(key): _writable(held) for key, held in value.items()}
        case list() | tuple():
            return [_writable(held) for held in value]
        case _:
            return value
