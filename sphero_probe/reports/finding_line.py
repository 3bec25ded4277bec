"""A finding as a line of a run's table."""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from sys import intern
from typing import Final, NamedTuple

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.model import Robot
from sphero_probe.probing.finding import Confidence, Outcome
from sphero_probe.probing.notes import node_name
from sphero_probe.reports import address_phrases, phrases
from sphero_probe.reports.ids import pair_spans
from sphero_probe.reports.phrases import shown
from sphero_probe.reports.states import state_and_answer

Data = Mapping[str, object]

NEW: Final = "NEW"
MAYBE: Final = "maybe"


class FindingLine(NamedTuple):
    """A finding as the table shows it.

    Attributes:
        number: place in the run.
        node: the node's name.
        did: device id.
        cid: command id.
        name: None where no catalogue knows the pair.
        arguments: with what it was sent, by the catalogue's layout; empty for none.
        risk: the class of the command with these arguments.
        outcome: as in the row.
        maybe: the outcome is not certain; only runs of version 0.1.0 have such findings.
        code: what was answered, ``0x02 bad command id``, empty without an answer.
        says: the state and the answer in words.
        note: a remark, or empty.
        rtt_ms: milliseconds, None without an answer.
        target: the address byte that the command was sent to, None where it has none.
    """

    number: int
    node: str
    did: int
    cid: int
    name: str | None
    arguments: str
    risk: str
    outcome: str
    maybe: bool
    code: str
    says: str
    note: str
    rtt_ms: float | None
    target: int | None = None

    @property
    def pair(self) -> str:
        """The ids as people write them."""
        return f"0x{self.did:02x}:0x{self.cid:02x}"

    @property
    def mark(self) -> str:
        """The mark before the ids, or nothing."""
        return MAYBE if self.maybe else NEW if self.new else ""

    @property
    def remark(self) -> str:
        """The note, unless it only says why the outcome is not certain."""
        return "" if self.maybe else self.note

    @property
    def exists(self) -> bool:
        """Whether the command certainly exists."""
        return self.outcome == Outcome.EXISTS and not self.maybe

    @property
    def new(self) -> bool:
        """Whether it exists, and no catalogue has it."""
        return self.name is None and self.exists


def whole_number(value: object) -> int:
    """Return a number of a row, 0 for anything else."""
    return value if isinstance(value, int) else 0


def robot_of(heading: Data | None) -> Robot | None:
    """Return the model that a run's heading names."""
    return ROBOTS.get(shown(heading.get("robot"))) if heading else None


def line_of(data: Data, robot: Robot | None) -> FindingLine:
    """Return a finding's row as a line."""
    target = asked if isinstance(asked := data.get("target"), int) else None
    rtt, code, name = data.get("rtt_ms"), data.get("code"), data.get("name")
    return FindingLine(
        whole_number(data.get("number")),
        _node(target, robot.key if robot else ""),
        whole_number(data.get("did")),
        whole_number(data.get("cid")),
        None if name is None else shown(name),
        phrases.arguments(data),
        shown(data.get("risk")),
        shown(data.get("outcome")),
        data.get("confidence") == Confidence.MAYBE,
        ""
        if code is None
        else intern(f"{phrases.hex_id(code)} {shown(data.get('code_name'))}"),  # few differ
        state_and_answer(data),
        "; ".join(filter(None, (shown(data.get("note")), _answered_by(data, robot)))),
        rtt if isinstance(rtt, int | float) else None,
        target,
    )


@lru_cache(maxsize=1024)
def _node(target: int | None, robot: str) -> str:
    """Return the name of a node of the robot with this key, which may be empty."""
    return node_name(target, ROBOTS.get(robot))


def _answered_by(data: Data, robot: Robot | None) -> str:
    """Return which other node answered, empty where it is the one that was asked or none was asked for."""
    source = data.get("answered_by")
    if data.get("target") is None or not isinstance(source, int):
        return ""
    if not address_phrases.answered_elsewhere(data):
        return ""
    return f"answered by {_node(source, robot.key if robot else '')}"


def ids(lines: Iterable[FindingLine], *, apart: bool) -> list[str]:
    """Return the ids of many lines as ranges; the first of each node after the node's name if wanted."""
    pairs: dict[str, list[tuple[int, int]]] = {}
    for line in lines:
        pairs.setdefault(f"{line.node} " if apart else "", []).append((line.did, line.cid))
    return [
        span if at else f"{node}{span}"
        for node, held in pairs.items()
        for at, span in enumerate(pair_spans(held))
    ]
