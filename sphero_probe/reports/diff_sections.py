"""The sections of a comparison's page, as raw text: differences by kind, and what could not be compared."""

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Final, NamedTuple

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.model import Robot
from sphero_probe.reports import phrases
from sphero_probe.reports.diff_rows import after, before, change_word
from sphero_probe.reports.ids import pair_spans
from sphero_probe.reports.phrases import Data, hex_id, shown
from sphero_probe.reports.rows import Row
from sphero_probe.runs.diff import Change

TITLES: Final = ("DID:CID", "Name", "Node", "A", "B")
"""The titles of the cells of a change."""
_MEANINGS: Final = {
    Change.APPEARED: "absent in A, exist in B",
    Change.DISAPPEARED: "exist in A, absent in B",
    Change.ANSWER: "another code, or an answer on one side only",
    Change.LAYOUT: "another length of the answer, or of the accepted arguments",
    Change.VALUE: "another value in the answer",
    Change.RISK: "another risk class",
    Change.NAME: "another name",
    Change.NEWLY_CERTAIN: "inconclusive in A",
    Change.NO_LONGER_CERTAIN: "inconclusive in B",
    Change.NOT_COMPARABLE: "exist on one side, without a result on the other",
}


class DiffSection(NamedTuple):
    """Changes of one kind.

    Attributes:
        title: one line.
        rows: cells for each change, under ``TITLES``.
    """

    title: str
    rows: Sequence[tuple[str, ...]]


class DiffPage:
    """Collects the rows of a comparison for a page."""

    def __init__(self) -> None:
        self.head: Data = {}
        self.counts: Data = {}
        self._differences: list[Data] = []
        self._uncertain: list[Data] = []

    def add(self, row: Row) -> None:
        """Keep a row of a comparison; rows of other types are left out."""
        match row.type:
            case "diff":
                self.head = row.data
            case "difference":
                self._differences.append(row.data)
            case "uncertain":
                self._uncertain.append(row.data)
            case "diff_summary":
                self.counts = row.data

    def sections(self) -> list[DiffSection]:
        """Return the differences, a section for each kind."""
        robot = robot_of(self.head)
        return [
            DiffSection(_title(kind, len(held)), [cells(data, robot) for data in held])
            for kind, held in _by_kind(self._differences)
        ]

    def uncertain(self) -> list[tuple[str, list[tuple[str, list[str]]]]]:
        """Return what is no difference: each kind with its reasons, and each reason with the ids."""
        return [
            (_title(kind, len(held)), _reasons(held, robot_of(self.head)))
            for kind, held in _by_kind(self._uncertain)
        ]


def robot_of(head: Data) -> Robot | None:
    """Return the model that a comparison is about: that of the second side, else of the first."""
    sides = (head.get("after"), head.get("before"))
    keys = (shown(side.get("robot")) for side in sides if isinstance(side, dict))
    return next(filter(None, map(ROBOTS.get, keys)), None)


def cells(data: Data, robot: Robot | None) -> tuple[str, ...]:
    """Return the cells of a change."""
    return (
        phrases.pair(data),
        shown(data.get("name")) or "unknown",
        node_name(data.get("node"), robot),
        before(data),
        after(data),
    )


def node_name(node: object, robot: Robot | None) -> str:
    """Return the name of a node by its number: ``primary``, ``node 3``, ``robot`` without addresses."""
    if not isinstance(node, int):
        return "robot"
    return (robot.nodes.get(node) if robot else None) or f"node {node}"


def _by_kind(rows: Iterable[Data]) -> list[tuple[Change, list[Data]]]:
    order = list(Change)
    known = [data for data in rows if data.get("kind") in order]
    known.sort(key=lambda data: order.index(Change(shown(data.get("kind")))))
    return [(Change(shown(kind)), list(held)) for kind, held in groupby(known, key=lambda data: data["kind"])]


def _title(kind: Change, count: int) -> str:
    return f"{count} {change_word(kind.value)}: {_MEANINGS[kind]}"


def _reasons(rows: Iterable[Data], robot: Robot | None) -> list[tuple[str, list[str]]]:
    reasons: dict[str, dict[str, list[tuple[int, int]]]] = {}
    for data in rows:
        did, cid = data.get("did"), data.get("cid")
        if isinstance(did, int) and isinstance(cid, int):
            reason = f"{_standing(data.get('before'))} in A, {_standing(data.get('after'))} in B"
            nodes = reasons.setdefault(reason, {})
            nodes.setdefault(node_name(data.get("node"), robot), []).append((did, cid))
    return [
        (
            reason,
            [
                span if at else f"{node} {span}"
                for node, pairs in nodes.items()
                for at, span in enumerate(pair_spans(pairs))
            ],
        )
        for reason, nodes in reasons.items()
    ]


def _standing(side: object) -> str:
    return change_word(side.get("standing")) if isinstance(side, dict) else ""


def line(data: Data, robot: Robot | None) -> str:
    """Return a difference in one line, for a log: ``appeared: primary 0x13:0x7f, absent -> exists``."""
    pair, name, node, old, new = cells(data, robot)
    ids = pair or hex_id(data.get("cid"))
    return f"{change_word(data.get('kind'))}: {node} {ids} {name}: {old} -> {new}"
