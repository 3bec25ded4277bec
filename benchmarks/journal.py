"""Measures what the journal costs for each probe of a sweep."""

import json
import os
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import Final

from benchmarks.section import Line, Options, Remark, Section
from benchmarks.timing import race, ratio
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.finding import Confidence, Finding, Outcome
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Response, Verdict
from sphero_probe.runs.encode import encode_finding, encode_intent
from sphero_probe.runs.journal import Journal

_A_SWEEP: Final = 1 << 16
_QUICK: Final = 1 << 12
"""Probes."""
_RATE: Final = 400
"""Commands per second; more than any robot has answered."""
_SHARE: Final = 0.01
"""The fraction of a sweep's time that the journal may take."""
_EXISTING: Final = 20
"""One probe in this many is answered with a value."""
_NODE: Final = 0x12

_Kept = tuple[PreparedProbe, Finding]


def measure(options: Options) -> Iterator[Line | Remark]:
    """Write the intent and the finding of every probe of a sweep, one write each, as a run does."""
    probes = [kept(number) for number in range(1, (_QUICK if options.quick else _A_SWEEP) + 1)]
    yield Remark(
        f"simulated: {len(probes)} probes, one in {_EXISTING} exists and answers with 8 bytes; "
        "an intent and a finding for each, one write per line, to a disk"
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.jsonl"
        times = race(
            {
                "journal": partial(_journal, probes, path),
                "writes": partial(_only_write, probes, path),
                "lines": partial(_lines, probes),
                "json": partial(_plain_json, probes),
            },
            options.rounds,
        )
    allowed = [_SHARE * len(probes) / _RATE] * options.rounds
    each = {name: median(seconds) / len(probes) * 1e6 for name, seconds in times.items()}
    yield Line(
        "journal of a probe, writes included",
        f"{_SHARE:.0%} of a sweep at {_RATE} commands/s",
        ratio(allowed, times["journal"]),
        1.0,
        note=(
            f"{each['journal']:.1f} of {_SHARE / _RATE * 1e6:.0f} us, "
            f"of which the writes alone take {each['writes']:.1f} us"
        ),
    )
    yield Line(
        "lines of a probe",
        "json.dumps",
        ratio(times["json"], times["lines"]),
        note=f"{each['lines']:.1f} us, json.dumps {each['json']:.1f} us",
    )


def kept(number: int) -> _Kept:
    """Return a probe of a sweep and its finding; ``number`` counts from 1."""
    did, cid = divmod(number - 1, 256)
    command, codec = Command(did, cid, b"", _NODE), CODECS[Generation.V2]
    there = number % _EXISTING == 0
    verdict = Verdict.OK if there else Verdict.NO_COMMAND
    code = next(code for code in range(256) if codec.verdict(code) is verdict)
    payload = number.to_bytes(8, "big") if there else b""
    response = Response(number % 255, code, payload, did, cid, _NODE, 0x01, 0x39)
    answered = Answered(
        command,
        response.seq,
        codec.encode_command(command, response.seq),
        response,
        codec.encode_response(response),
        0.04 + number / 3e7,
    )
    outcome = Outcome.EXISTS if there else Outcome.ABSENT
    name = codec.code_name(code)
    finding = Finding(number, command, outcome, Confidence.CERTAIN, Risk.PROBE, answered, None, name, 1)
    return PreparedProbe(number, command, Risk.PROBE, None, ""), finding


def _journal(probes: list[_Kept], path: Path) -> None:
    with Journal.create(path) as journal:
        for asked, finding in probes:
            journal.intend(asked)
            journal.record(finding)
    path.unlink()


def _only_write(probes: list[_Kept], path: Path) -> None:
    """Only write lines of the same length, to measure the operating system."""
    intent, finding = (bytes(len(line)) for line in _two_lines(*probes[-1]))
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    for _ in probes:
        os.write(descriptor, intent)
        os.write(descriptor, finding)
    os.close(descriptor)
    path.unlink()


def _lines(probes: list[_Kept]) -> None:
    for asked, finding in probes:
        _two_lines(asked, finding)


def _two_lines(asked: PreparedProbe, finding: Finding) -> tuple[bytes, bytes]:
    return encode_intent(asked.number, asked.command, asked.risk), encode_finding(finding)


def _plain_json(probes: list[_Kept]) -> None:
    """Encode the same objects with ``json.dumps``."""
    for asked, finding in probes:
        _dumped({"type": "intent", "number": asked.number, **_about(asked.command), "risk": asked.risk.word})
        assert isinstance(finding.exchange, Answered)
        _dumped(
            {
                "type": "finding",
                "number": finding.number,
                **_about(finding.command),
                "outcome": finding.outcome,
                "confidence": finding.confidence,
                "risk": finding.risk.word,
                "attempts": finding.attempts,
                "note": finding.note,
                "exchange": "answered",
                "seq": finding.exchange.seq,
                "sent": finding.exchange.sent.hex(),
                "received": finding.exchange.received.hex(),
                "seconds": finding.exchange.rtt,
            }
        )


def _about(command: Command) -> dict[str, object]:
    did, cid, payload, target, _ = command
    return {"target": target, "did": did, "cid": cid, "payload": payload.hex()}


def _dumped(data: dict[str, object]) -> bytes:
    return (json.dumps(data, separators=(",", ":"), allow_nan=False) + "\n").encode("ascii")


SECTION = Section("journal", "the cost of writing every intent and finding", measure)
