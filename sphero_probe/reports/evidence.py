"""Evidence as rows and as markdown: which open questions it settles, for the maintainer who gets the file."""

import re
from collections.abc import Iterable, Iterator, Sequence
from statistics import median
from typing import Final

from sphero_probe.probing.evidence import Burst, Ending, Evidence, Replaced
from sphero_probe.probing.notes import node_name
from sphero_probe.probing.open_questions import settlements
from sphero_probe.reports.phrases import shown
from sphero_probe.reports.printable import visible
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import Column, Place, View

_LINES: Final = {
    "ble": "over Bluetooth LE",
    "serial": "through a serial port",
    "rfcomm": "over Bluetooth Classic",
    "fake": "to the built-in robot",
    "replay": "to a recording",
}

_CHECK: Final = (
    "`sphero-probe evidence check FILE --json` checks the JSON file, and prints what public sources say "
    "about each question."
)
_MARKS: Final = re.compile(r"[\\`*_\[\]<>|#]")
"""What markdown would read as a mark."""

SETTLEMENTS: Final = View(
    "settlement",
    (
        Column("question", "Question", lambda data: shown(data.get("question"))),
        Column("settled", "Settled", lambda data: "yes" if data.get("settled") else "no", whole=True),
        Column("answer", "Answer, or what is missing", lambda data: shown(data.get("answer"))),
        Column("key", "Key", lambda data: shown(data.get("key")), Place.RECORD),
        Column("background", "Background", lambda data: shown(data.get("background")), Place.RECORD),
    ),
    "No open question.",
)
"""The open questions, and what evidence says about each."""


def settlement_rows(evidence: Evidence) -> Iterator[Row]:
    """Yield a row for each open question that the robot can help to settle."""
    for question, (settled, text) in settlements(evidence):
        yield Row(
            "settlement",
            {
                "question": question.text,
                "settled": settled,
                "answer": text,
                "key": question.key,
                "background": question.background or None,
            },
        )


def reservations(evidence: Evidence) -> list[str]:
    """Return what a reader must know before trusting the evidence, one sentence each."""
    said: list[str] = []
    if evidence.is_simulated:
        said.append("No real robot answered: this settles nothing about one.")
    if not evidence.complete:
        said.append("The run ended early: questions may be open because nothing was asked about them.")
    for did, cid, payload, *_ in evidence.surprises:
        said.append(
            f"The robot executed 0x{did:02x}:0x{cid:02x} at a length that it does not take"
            f" ({len(payload)} bytes). Its node got no further wrong length."
        )
    return said


def headline(evidence: Evidence) -> str:
    """Return model and firmware in one line."""
    robot = evidence.model
    model = robot.name if robot else f"a robot of an unknown model ({evidence.generation.upper()})"
    firmware = ", ".join(f"{node} {version}" for node, version in evidence.firmware.items())
    return f"{model}, firmware {firmware}" if firmware else f"{model}, firmware not told"


def markdown(evidence: Evidence) -> str:
    """Return the summary of redacted evidence that goes with its JSON file."""
    asked = evidence.asked
    counts = {ending: sum(one.ending is ending for one in asked) for ending in Ending}
    intro = (
        f"sphero-probe {_cell(evidence.tool_version)} sent {evidence.frames_sent} commands in "
        f"{evidence.seconds:.1f} s {_LINES.get(evidence.line, evidence.line)}. Only documented reads, "
        "commands that cannot exist and, where the robot rejects them, wrong lengths were sent."
    )
    content = (
        f"The JSON file lists {len(asked)} of the commands with their answers: {counts[Ending.ANSWERED]} "
        f"answered, {counts[Ending.SILENT]} not answered, {counts[Ending.BLOCKED]} not sent because of their "
        "risk. Neither file holds the name, an address or a serial number of the robot, anything about the "
        f"computer, or a date. {_replaced(sum(isinstance(one.data, Replaced) for one in asked))}"
    )
    parts = (
        f"# Evidence: {_cell(headline(evidence))}",
        intro,
        *(f"**{_cell(sentence)}**" for sentence in reservations(evidence)),
        content,
        "## Open questions",
        _table(("Question", "Settled", "Answer, or what is missing"), _questions(evidence)),
        "## Nodes",
        _table(("Node", "Address", "Firmware", "Length checks", "Why"), _nodes(evidence)),
        "## Echoes sent at once",
        _table(
            ("Sent", "Answered", "Busy", "In order", "Median ms", "Longest ms"), map(_burst, evidence.bursts)
        ),
        _CHECK,
    )
    return "\n\n".join(parts) + "\n"


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *(list(map(_cell, row)) for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _replaced(count: int) -> str:
    if not count:
        return "No data of an answer had to be replaced."
    answers = "one answer is" if count == 1 else f"{count} answers is"
    return f"The data of {answers} replaced by its length and a digest, as it might identify the robot."


def _questions(evidence: Evidence) -> Iterator[Sequence[str]]:
    for question, (is_settled, text) in settlements(evidence):
        yield question.text, "yes" if is_settled else "no", text


def _nodes(evidence: Evidence) -> Iterator[Sequence[str]]:
    for target, strictness, why in evidence.nodes:
        name = node_name(target, evidence.model)
        address = "none" if target is None else f"0x{target:02x}"
        yield name, address, evidence.firmware_of(name), strictness, why


def _burst(burst: Burst) -> Sequence[str]:
    times = burst.milliseconds
    middle, longest = (f"{median(times):.1f}", f"{max(times):.1f}") if times else ("", "")
    counts = map(str, (burst.sent, burst.answered, burst.busy))
    return (*counts, "yes" if burst.in_order else "no", middle, longest)


def _cell(text: str) -> str:
    """Return a text that is shown as it is, whatever it holds, also in a cell of a table."""
    return _MARKS.sub(r"\\\g<0>", visible(text, limit=400))
