"""Journals written by hand, so that a test about many runs needs no robot."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, Blocked, Silent
from sphero_probe.probing.finding import Confidence, Finding, Heading, Note, Outcome, Summary
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Response
from sphero_probe.runs.decode import Entry, Opening
from sphero_probe.runs.encode import encode
from sphero_probe.runs.store import runs_folder

V2 = Generation.V2
CODES = {Outcome.EXISTS: 0x00, Outcome.ABSENT: 0x02}


def finding(
    number: int, did: int, cid: int, outcome: Outcome = Outcome.EXISTS, target: int = 0x11
) -> Finding:
    command = Command(did, cid, b"", target)
    sent = CODECS[V2].encode_command(command, 7)
    exchange: Answered | Silent | Blocked = Silent(command, 7, sent, 0.5)
    if outcome in CODES:
        response = Response(7, CODES[outcome], b"", did, cid, target, 0x01, 0x39)
        exchange = Answered(command, 7, sent, response, CODECS[V2].encode_response(response), 0.03)
    elif outcome is Outcome.SKIPPED:
        exchange = Blocked(command, Risk.BRICK, "not allowed")
    return Finding(number, command, outcome, Confidence.CERTAIN, Risk.PROBE, exchange, None, "", 1)


def keep(
    name: str,
    *,
    robot: str = "BP-1",
    model: str = "bolt-plus",
    firmware: Mapping[str, str] | None = None,
    findings: Iterable[Finding] = (),
    notes: Iterable[Note] = (),
    complete: bool = True,
    started: str = "2026-01-02T03:04:05Z",
    written: int = 0,
    folder: Path | None = None,
) -> Path:
    """Write the journal of a run in the folder of runs; ``written``: seconds since the epoch."""
    path = (folder or runs_folder()) / f"{name}.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    found = list(findings)
    counts = {word: sum(one.outcome is word for one in found) for word in Outcome}
    versions = {"primary": "1.0"} if firmware is None else dict(firmware)
    entries: list[Entry] = [
        Opening("sweep", "sweep", "", {}, "", f"fake:{model}", V2, model, robot, ("read",)),
        Heading(model, f"Sphero {model}", robot, versions, "sweep", "0.1.0", ("read",), {}, started),
        *notes,
        *found,
        Summary({word: count for word, count in counts.items() if count}, 1.5, len(found), 9, complete),
    ]
    path.write_bytes(b"".join(map(encode, entries)))
    if written:
        os.utime(path, (written, written))
    return path
