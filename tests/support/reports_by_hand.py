"""Hand-made runs and lists for the tests of reports, with untrusted text in every field."""

import io
import re
from collections import Counter
from collections.abc import Iterable, Sequence

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.probing.dry_run import PlannedProbe
from sphero_probe.probing.facts import Fact
from sphero_probe.probing.finding import Finding, Heading, Note, Outcome, Summary
from sphero_probe.probing.judge import judge
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Malformed, Notification, Response
from sphero_probe.reports import checks, diff_rows, views
from sphero_probe.reports.registry import Style, open_report
from sphero_probe.reports.rows import (
    Row,
    command_row,
    fact_row,
    finding_row,
    heading_row,
    note_row,
    packet_row,
    plan_row,
    planned_row,
    robot_row,
    summary_row,
)
from sphero_probe.runs.diff import compare
from sphero_probe.runs.sides import observation_of, run_side
from sphero_probe.transports.base import Seen

V2 = Generation.V2
CODEC = CODECS[V2]
BOLT = ROBOTS["bolt"]
PRIMARY, SECONDARY = 0x11, 0x12

FINDING_KEYS = [
    "number",
    "target",
    "answered_by",
    "did",
    "cid",
    "name",
    "risk",
    "outcome",
    "confidence",
    "code",
    "code_name",
    "payload",
    "fields",
    "units",
    "sent",
    "received",
    "rtt_ms",
    "attempts",
    "note",
    "state",
    "request",
    "arguments",
]
"""The columns of a finding, in their order."""

HOSTILE = "BP\x1b]0;pwn\x07\x9b31m\u202e\u200b\n\t=1+1[bold]:smile:\ud800\U000e0041\u2028"
"""A terminal title, colours, bidi, zero width, a lone surrogate, a tag, separators, markup, a formula."""

HEADING = Heading(
    robot="bolt",
    model="Sphero BOLT",
    device="SB-1B2C",
    firmware={"primary": "5.0.2", "secondary": "4.1.7"},
    plan="sweep",
    tool_version="0.1.0",
    consent=("read", "probe"),
    strictness={},
    started="2025-11-21T22:31:00Z",
)
CALIBRATED = Note(
    "calibration",
    "primary: strict (surplus bytes are rejected, and only where a command exists)",
    {"target": PRIMARY, "strictness": "strict"},
)


def found(
    number: int, command: Command, exchange: Exchange, attempts: int = 1, masked: bool = False
) -> Finding:
    judgement = judge(exchange, CODEC, masked=masked)
    return Finding(
        number,
        command,
        judgement.outcome,
        judgement.confidence,
        exchange.risk if isinstance(exchange, Blocked) else Risk.PROBE,
        exchange,
        lookup(V2, command.did, command.cid, BOLT),
        CODEC.code_name(exchange.response.code) if isinstance(exchange, Answered) else "",
        attempts,
        judgement.note,
    )


def answered(
    number: int,
    did: int,
    cid: int,
    code: int,
    payload: bytes = b"",
    *,
    target: int | None = PRIMARY,
    masked: bool = False,
    request: bytes = bytes(11),
) -> Finding:
    command = Command(did, cid, request, target)
    seq = number % 255
    response = Response(seq, code, payload, did, cid, target, flags=0x09)
    exchange = Answered(
        command, seq, CODEC.encode_command(command, seq), response, CODEC.encode_response(response), 0.0312
    )
    return found(number, command, exchange, masked=masked)


def silent(number: int, did: int, cid: int, *, target: int | None = PRIMARY, attempts: int = 3) -> Finding:
    command = Command(did, cid, bytes(11), target)
    return found(number, command, Silent(command, 7, CODEC.encode_command(command, 7), 1.0), attempts)


def refused(
    number: int, did: int, cid: int, risk: Risk, reason: str, *, target: int | None = PRIMARY
) -> Finding:
    command = Command(did, cid, bytes(11), target)
    return found(number, command, Blocked(command, risk, reason), attempts=0)


def summary(findings: Iterable[Finding], *, complete: bool = True) -> Summary:
    counts: dict[Outcome, int] = dict(Counter(finding.outcome for finding in findings))
    return Summary(counts, 1.234, sum(counts.values()), sum(counts.values()), complete)


def run_of(findings: Sequence[Finding], notes: Sequence[Row] = (), *, complete: bool = True) -> list[Row]:
    """The rows of a whole run."""
    ending = summary_row(summary(findings, complete=complete))
    return [heading_row(HEADING), *notes, *map(finding_row, findings), ending]


def rendered(
    form: str,
    rows: Iterable[Row],
    view: views.View = views.FINDINGS,
    *,
    width: int = 80,
    color: bool = False,
    unicode: bool = True,
    detail: bool = False,
    header: bool = False,
) -> str:
    out = io.StringIO()
    report = open_report(form, out, view=view, style=Style(width, color, unicode, detail, header))
    for row in rows:
        report.add(row)
    report.close()
    return out.getvalue()


ASKED = [
    answered(1, 0x13, 0x10, 0x00, b"\x57"),
    answered(2, 0x13, 0x99, 0x05),
    answered(3, 0x13, 0x98, 0x02),
    silent(4, 0x13, 0x97),
    refused(5, 0x13, 0x00, Risk.BRICK, "brick: power.enter_deep_sleep (--allow brick)"),
    answered(6, 0x13, 0x25, 0x00, bytes.fromhex("7fc00000")),
    answered(7, 0x10, 0x00, 0x00, b"=1+1"),
]
RUN = run_of(ASKED, [note_row(CALIBRATED)])


def survey_of(value: object) -> dict[str, object]:
    """The data of a note on nodes with the same value in every place."""
    keys = ("address", "node", "name", "state", "code", "code_name", "answered_by", "firmware", "devices")
    system = dict.fromkeys(("name", "line", "client", "client_means", "addressing"), value)
    served = dict.fromkeys(("did", "cid", "name", "node"), value)
    nodes: list[object] = [dict.fromkeys(keys, value) | {"serves": [served, value]}, value]
    return {"system": system, "nodes": nodes}


def hostile_rows(text: str) -> dict[str, tuple[views.View, list[Row]]]:
    """Untrusted text in every field of every row type that can hold some."""
    raw = text.encode("utf-8", "surrogatepass")[:200]
    heading = HEADING._replace(
        robot=text,
        model=text,
        device=text,
        firmware={text: text},
        plan=text,
        tool_version=text,
        consent=(text,),
        strictness={text: text},
        started=text,
        line=text,
    )
    findings = [
        answered(1, 0x11, 0x06, 0x00, raw + b"\0"),
        answered(2, 0x13, 0x99, 0x00, raw)._replace(code_name=text, note=text),
        refused(3, 0x13, 0x98, Risk.PERSIST, text),
        silent(4, 0x13, 0x97)._replace(note=text),
    ]
    finding_rows = [
        *map(finding_row, findings),
        Row("finding", finding_row(findings[0]).data | {"name": text}),
    ]
    notes = [
        note_row(Note("malformed", text, {"raw": raw.hex(), text: text})),
        note_row(Note(text, text, {"name": text, "fields": {text: text}})),
    ]
    surveyed = note_row(Note("nodes", text, survey_of(text)))
    ending = summary_row(summary(findings, complete=False))
    known = lookup(V2, 0x13, 0x10, BOLT)
    assert known
    return {
        "run": (
            views.FINDINGS,
            [heading_row(heading), surveyed, *notes, *finding_rows, ending],
        ),
        "finding": (views.FINDING, finding_rows),
        "notes": (views.NOTES, notes),
        "robots": (
            views.ROBOTS,
            [robot_row(Seen(text, None, text, -61)), robot_row(Seen(text, BOLT, text, 0))],
        ),
        "packets": (
            views.PACKETS,
            [
                packet_row(Malformed(raw, text), V2, raw),
                packet_row(Response(1, 0, raw, 0x11, 0x06), V2, raw),
                packet_row(Notification(0x10, 0x03, raw), V2, raw),
            ],
        ),
        "commands": (views.COMMANDS, [command_row(known._replace(name=text, note=text, aliases=(text,)))]),
        "command": (views.COMMAND, [command_row(known._replace(name=text, note=text, sources=(text,)))]),
        "plans": (views.PLANS, [plan_row(text, text, text, [text])]),
        "planned": (
            views.PLANNED,
            [planned_row(PlannedProbe(1, Command(1, 2, raw), None, Risk.READ, raw, text))],
        ),
        "codes": (
            views.CODES,
            [Row("code", dict.fromkeys(("generation", "code", "name", "meaning", "proves"), text))],
        ),
        "facts": (views.FACTS, [fact_row(Fact(text, text, text, text)), fact_row(Fact("x", float("nan")))]),
        "differences": (diff_rows.DIFFERENCES, differences(text)),
        "checks": (checks.CHECKS, [checks.check_row(text, checks.Look(checks.State.FAIL, text, text))]),
    }


def differences(text: str) -> list[Row]:
    """A comparison with untrusted text in every place that can hold some."""
    raw = text.encode("utf-8", "surrogatepass")[:200]
    heading = HEADING._replace(model=text, device=text, firmware={text: text, "primary": text}, started=text)
    old = [
        answered(1, 0x13, 0x99, 0x02),
        answered(2, 0x19, 0x04, 0x00, b"x\0"),
        answered(3, 0x13, 0x98, 0x05),
    ]
    new = [
        answered(1, 0x13, 0x99, 0x05, raw),
        answered(2, 0x19, 0x04, 0x00, raw + b"\0"),
        refused(3, 0x13, 0x98, Risk.PERSIST, text),
    ]
    named = [observation_of(finding)._replace(name=text) for finding in new]
    before = run_side(text, "run", CODEC, HEADING, map(observation_of, old), complete=True)
    after = run_side(text, "report", CODEC, heading, named, complete=False)
    return diff_rows.diff_rows(compare(before, after, values=True))


LISTS = {name: held for name, held in hostile_rows("BP-1234 ready").items() if name != "run"}


def expanded(text: str) -> set[tuple[int, int]]:
    """All pairs that a page names, ranges too."""
    pairs: set[tuple[int, int]] = set()
    for found in re.finditer(r"0x(\w\w)(?:-0x(\w\w))?:0x(\w\w)(?:-0x(\w\w))?", text):
        first, last, low, high = found.groups()
        dids = range(int(first, 16), int(last or first, 16) + 1)
        pairs |= {(did, cid) for did in dids for cid in range(int(low, 16), int(high or low, 16) + 1)}
    return pairs
