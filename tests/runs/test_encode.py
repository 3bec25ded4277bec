"""Lines of a journal: the quick way to write them gives the bytes that plain JSON gives."""

import json
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import BadLineError
from sphero_probe.link.exchange import Answered, Blocked, Silent
from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome, Record, Summary
from sphero_probe.protocol.packets import Command, Generation, Response, SendOptions
from sphero_probe.runs.decode import Entry, Intent, Opening, summary_of
from sphero_probe.runs.encode import encode
from sphero_probe.runs.fields import Fields

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=4,
)
TEXTS = st.text(max_size=20) | st.sampled_from(["", "\ud800", '"\\', "\x1b]0;x\x07\u202e\u2028", "x" * 600])
BYTES = st.integers(0, 255)
SECONDS = st.floats(0, 1e9) | st.sampled_from([0, 0.0, 5e-324, 0.1 + 0.2, 1e16, 1e22])
COMMANDS = st.builds(Command, BYTES, BYTES, st.binary(max_size=30), st.none() | BYTES)
NUMBERS = st.integers(1, 1 << 31)
RISKS = st.sampled_from(Risk)
NAMED = st.dictionaries(TEXTS, TEXTS, max_size=3)
WORDS = st.lists(RISKS.map(lambda risk: risk.word), unique=True).map(tuple)
EXCHANGES = st.one_of(
    st.builds(
        Answered, COMMANDS, BYTES, st.binary(max_size=20), st.just(Response(1, 0)), st.binary(), SECONDS
    ),
    st.builds(Silent, COMMANDS, BYTES, st.binary(max_size=20), SECONDS),
    st.builds(Blocked, COMMANDS, RISKS, TEXTS),
)
ENTRIES = st.one_of(
    st.builds(
        Finding,
        NUMBERS,
        COMMANDS,
        st.sampled_from(Outcome),
        st.sampled_from(Confidence),
        RISKS,
        EXCHANGES,
        st.none(),
        TEXTS,
        st.integers(0, 9),
        TEXTS,
    ),
    st.builds(Intent, NUMBERS, COMMANDS, RISKS),
    st.builds(Note, TEXTS, TEXTS, st.dictionaries(TEXTS, VALUES, max_size=3)),
    st.builds(
        Opening, TEXTS, TEXTS, TEXTS, NAMED, TEXTS, TEXTS, st.sampled_from(Generation), TEXTS, TEXTS, WORDS
    ),
    st.builds(Heading, TEXTS, TEXTS, TEXTS, NAMED, TEXTS, TEXTS, WORDS, NAMED, TEXTS),
    st.builds(
        Summary,
        st.dictionaries(st.sampled_from(Outcome), NUMBERS),
        SECONDS,
        NUMBERS,
        NUMBERS,
        st.booleans(),
        NAMED,
    ),
)


def spelled_out(entry: Entry, resumed: bool) -> dict[str, object]:
    """What a line holds, key by key in the order of the file."""
    told: dict[str, Any] = entry._asdict()
    match entry:
        case Opening():
            return {"type": "journal", "schema_version": 1} | told | {"plan": entry.plan[:512]}
        case Heading():
            return {"type": "run", "resumed": resumed} | told | {"plan": entry.plan[:512]}
        case Note():
            return {"type": "note"} | told | {"data": finite(entry.data)}
        case Summary():
            return {"type": "summary"} | told
    command = entry.command
    held: dict[str, object] = {
        "number": entry.number,
        "target": command.target,
        "did": command.did,
        "cid": command.cid,
        "payload": command.payload.hex(),
    }
    if command.options != SendOptions():
        held["options"] = command.options._asdict()
    if isinstance(entry, Intent):
        return {"type": "intent", **held, "risk": entry.risk.word}
    held |= {key: told[key] for key in ("outcome", "confidence")}
    held |= {"risk": entry.risk.word, "attempts": entry.attempts, "note": entry.note}
    match entry.exchange:
        case Answered(seq=seq, sent=sent, received=received, rtt=seconds):
            frames = {"sent": sent.hex(), "received": received.hex()}
            held |= {"exchange": "answered", "seq": seq, **frames, "seconds": seconds}
        case Silent(seq=seq, sent=sent, waited=seconds):
            held |= {"exchange": "silent", "seq": seq, "sent": sent.hex(), "seconds": seconds}
        case Blocked(reason=reason):
            held |= {"exchange": "refused", "reason": reason}
    return {"type": "finding", **held}


def finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: finite(held) for key, held in value.items()}
    if isinstance(value, list):
        return [finite(held) for held in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


@settings(max_examples=150)
@given(ENTRIES, st.booleans())
def test_a_line_is_its_entry_in_plain_json(entry: Intent | Opening | Record, resumed: bool) -> None:
    plain = json.dumps(spelled_out(entry, resumed), separators=(",", ":")) + "\n"
    assert encode(entry, resumed=resumed) == plain.encode("ascii")


def test_the_lines_of_a_probe_as_files_have_them() -> None:
    command = Command(0x13, 0x10, b"\xff\x00", 0x12)
    answer = Answered(command, 7, b"\x8d\xd8", Response(7, 0), b"\x8d\x00\xd8", 0.0625)
    found = Finding(17, command, Outcome.EXISTS, Confidence.CERTAIN, Risk.PROBE, answer, None, "ok", 1, "é")
    assert encode(Intent(17, command, Risk.READ)) == (
        b'{"type":"intent","number":17,"target":18,"did":19,"cid":16,"payload":"ff00","risk":"read"}\n'
    )
    assert encode(found) == (
        b'{"type":"finding","number":17,"target":18,"did":19,"cid":16,"payload":"ff00","outcome":"exists",'
        b'"confidence":"certain","risk":"probe","attempts":1,"note":"\\u00e9","exchange":"answered","seq":7,'
        b'"sent":"8dd8","received":"8d00d8","seconds":0.0625}\n'
    )


def test_a_summary_without_length_checks_is_one_of_an_earlier_version() -> None:
    summary = Summary({Outcome.EXISTS: 2}, 1.5, 2, 9, complete=True, strictness={"primary": "strict"})
    line = json.loads(encode(summary))
    assert summary_of(Fields(line)) == summary
    del line["strictness"]
    assert summary_of(Fields(line)) == summary._replace(strictness={})
    with pytest.raises(BadLineError, match="strictness"):
        summary_of(Fields(line | {"strictness": ["strict"]}))
