"""Says what a run proved about each command id of a node: one state for each cell of a map of 256 x 256."""

from collections.abc import Iterable
from enum import Enum
from typing import Final, NamedTuple

from sphero_probe.catalogue import commands_of
from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.probing.finding import Outcome
from sphero_probe.protocol.address import Address
from sphero_probe.reports.finding_line import FindingLine

IDS: Final = 256
"""Device ids, and command ids of each."""


class CellState(Enum):
    """What is known of one command, the most telling first: of several findings, the first one counts.

    Attributes:
        word: for people.
        sign: one character, so that colour never stands alone; every sign is different.
    """

    EXISTS = ("exists", "E")
    NEW = ("exists, in no catalogue", "N")
    SILENT = ("silent", "S")
    MISSING = ("documented, but absent", "x")
    ABSENT = ("absent", "\N{MIDDLE DOT}")
    DOCUMENTED = ("documented, not confirmed", "D")
    INCONCLUSIVE = ("inconclusive", "?")
    BLOCKED = ("blocked: not sent", "B")
    NOT_ASKED = ("not asked", "-")

    def __init__(self, word: str, sign: str) -> None:
        self.word = word
        self.sign = sign


STATES: Final = tuple(CellState)
_RANK: Final = {state: rank for rank, state in enumerate(STATES)}
_OPEN: Final[dict[str, CellState]] = {
    Outcome.SKIPPED: CellState.BLOCKED,
    Outcome.INCONCLUSIVE: CellState.INCONCLUSIVE,
    Outcome.SENT: CellState.INCONCLUSIVE,
}


class NodeMap(NamedTuple):
    """The states of one node.

    Attributes:
        target: the node's address byte, None for a robot without addresses.
        name: the node's name.
        cells: ``cells[did][cid]`` is an index of ``STATES``.
        documented: the commands that the catalogue lists for it, as DID and CID.
    """

    target: int | None
    name: str
    cells: tuple[bytearray, ...]
    documented: frozenset[tuple[int, int]]

    def state(self, did: int, cid: int) -> CellState:
        """Return the state of a command."""
        return STATES[self.cells[did][cid]]

    def counts(self, did: int) -> dict[CellState, int]:
        """Return how many commands of a device have each state, without zeros."""
        row = self.cells[did]
        counted = {state: row.count(rank) for state, rank in _RANK.items()}
        return {state: count for state, count in counted.items() if count}


def documented_commands(robot: Robot | None, target: int | None) -> frozenset[tuple[int, int]]:
    """Return the commands that the catalogue lists for a node of a robot, as DID and CID."""
    if robot is None:
        return frozenset()
    node = None if target is None else Address.from_byte(target).node
    return frozenset(
        (row.did, row.cid)
        for row in commands_of(robot)
        if row.kind is Kind.COMMAND and (node is None or not (nodes := row.nodes[robot.key]) or node in nodes)
    )


def state_of(line: FindingLine, *, documented: bool) -> CellState:
    """Return the state that a finding gives its command.

    Args:
        line: the finding.
        documented: the catalogue lists the command for this node of the robot.
    """
    if line.outcome == Outcome.EXISTS:
        if line.maybe:
            return CellState.INCONCLUSIVE
        return CellState.NEW if line.new else CellState.EXISTS
    if line.outcome == Outcome.SILENT:
        return CellState.SILENT
    if line.outcome == Outcome.ABSENT:
        return CellState.MISSING if documented else CellState.ABSENT
    return CellState.DOCUMENTED if documented else _OPEN.get(line.outcome, CellState.INCONCLUSIVE)


def node_maps(lines: Iterable[FindingLine], robot: Robot | None, *, partly: bool = False) -> list[NodeMap]:
    """Return a map for each node that a run asked; documented commands without a finding are marked.

    Args:
        lines: the findings; ids that are not bytes are left out.
        robot: the model, None if it is not known.
        partly: other findings are left out, so that a command without one may have been asked: it is not
            marked.
    """
    maps: dict[int | None, NodeMap] = {}
    for line in lines:
        node = maps.get(line.target)
        if node is None:
            cells = tuple(bytearray([_RANK[CellState.NOT_ASKED]]) * IDS for _ in range(IDS))
            node = NodeMap(line.target, line.node, cells, documented_commands(robot, line.target))
            maps[line.target] = node
        if 0 <= line.did < IDS and 0 <= line.cid < IDS:
            row = node.cells[line.did]
            state = state_of(line, documented=(line.did, line.cid) in node.documented)
            row[line.cid] = min(row[line.cid], _RANK[state])
    for node in () if partly else maps.values():
        for did, cid in node.documented:
            if node.state(did, cid) is CellState.NOT_ASKED:
                node.cells[did][cid] = _RANK[CellState.DOCUMENTED]
    return sorted(maps.values(), key=lambda one: -1 if one.target is None else one.target)
