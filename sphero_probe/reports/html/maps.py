"""Draws what a node has: an overview of 256 x 256 commands, and a map of 16 x 16 for each device."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Final

from sphero_probe.catalogue import DEVICE_NAMES
from sphero_probe.catalogue.model import Robot
from sphero_probe.reports.cell_states import IDS, STATES, CellState, NodeMap
from sphero_probe.reports.html.page import ascii_only, text
from sphero_probe.reports.ids import spans

KEYS: Final = {
    CellState.EXISTS: "e",
    CellState.NEW: "n",
    CellState.SILENT: "s",
    CellState.MISSING: "x",
    CellState.ABSENT: "a",
    CellState.DOCUMENTED: "d",
    CellState.INCONCLUSIVE: "q",
    CellState.BLOCKED: "b",
    CellState.NOT_ASKED: "o",
}
"""State -> its class in the style sheet."""
_CELLS: Final = tuple((f'<td class="{KEYS[state]}">', ascii_only(state.sign)) for state in STATES)
_SIDE: Final = 16
_TELLING: Final = frozenset((CellState.EXISTS, CellState.NEW, CellState.SILENT, CellState.MISSING))
"""States that give a device a map of its own."""
_MIXED: Final = frozenset((CellState.DOCUMENTED, CellState.INCONCLUSIVE, CellState.BLOCKED))
"""States that do so where the device also has other commands that were asked."""


def sign(state: CellState) -> str:
    """Return the sign of a state in its colours."""
    return f'<span class="sign {KEYS[state]}">{ascii_only(state.sign)}</span>'


def node_key(target: int | None) -> str:
    """Return the part of an anchor that names a node."""
    return "robot" if target is None else f"{target:02x}"


def device_title(did: int, robot: Robot | None) -> str:
    """Return a device as ``0x13 power``."""
    name = DEVICE_NAMES[robot.generation].get(did, "") if robot else ""
    return f"0x{did:02x} {name}".rstrip()


def mapped_devices(node: NodeMap) -> list[int]:
    """Return the devices that get a map; of the others, a table says everything."""
    return [did for did in range(IDS) if _has_map(node.counts(did).keys())]


def _has_map(states: Collection[CellState]) -> bool:
    asked = frozenset(states) - {CellState.NOT_ASKED}
    return bool(_TELLING & asked) or (len(asked) > 1 and bool(_MIXED & asked))


def overview(node: NodeMap, robot: Robot | None) -> Iterator[str]:
    """Yield the picture of a whole node, with a link for each device that has a map.

    It is hidden from screen readers: the table of devices says the same.
    """
    yield (
        '<figure><svg class="overview" viewBox="-12 -8 272 268" aria-hidden="true" focusable="false" '
        'shape-rendering="crispEdges">\n'
    )
    for rank, state in enumerate(STATES):
        path = "".join(_runs(node, rank))
        if path and state is not CellState.NOT_ASKED:
            yield f'<path class="{KEYS[state]}" d="{path}"/>\n'
    for at in range(0, IDS, _SIDE):
        yield f'<text x="{at}" y="-2">{at:02x}</text><text x="-8" y="{at + 4}">{at:02x}</text>\n'
    key = node_key(node.target)
    for did in mapped_devices(node):
        title = text(f"{device_title(did, robot)}: {in_words(node.counts(did))}")
        yield (
            f'<a href="#d-{key}-{did:02x}" tabindex="-1"><title>{title}</title>'
            f'<rect class="hit" x="0" y="{did}" width="256" height="1"/></a>\n'
        )
    yield (
        '<rect class="frame" x="0" y="0" width="256" height="256"/></svg>\n'
        "<figcaption>Each row is a device id, each column a command id. A row with commands leads to the map "
        "of its device; the table of devices says the same in words.</figcaption></figure>\n"
    )


def _runs(node: NodeMap, rank: int) -> Iterator[str]:
    """Yield the path of the cells of one state, a rectangle for each run of neighbours."""
    for did, row in enumerate(node.cells):
        if rank in row:
            at = 0
            for held, group in groupby(row):
                length = len(list(group))
                if held == rank:
                    yield f"M{at} {did}h{length}v1h-{length}z"
                at += length


def in_words(counts: Mapping[CellState, int]) -> str:
    """Return counts as ``7 exists; 235 absent``, without those that were not asked."""
    asked = (pair for pair in counts.items() if pair[0] is not CellState.NOT_ASKED)
    return "; ".join(f"{count} {state.word}" for state, count in asked)


def device_table(node: NodeMap, robot: Robot | None) -> str:
    """Return the table of devices: how many commands of each have which state.

    Neighbouring devices without a map and with the same counts share a row.
    """
    mapped = frozenset(mapped_devices(node))
    used = [state for state in STATES if any(state in node.counts(did) for did in range(IDS))]
    rows: list[str] = []
    alike: dict[tuple[tuple[CellState, int], ...], list[int]] = {}
    for did in range(IDS):
        if did in mapped:
            link = f'<a href="#d-{node_key(node.target)}-{did:02x}">{text(device_title(did, robot))}</a>'
            rows.append(_device_row(link, node.counts(did), used))
        else:
            alike.setdefault(tuple(node.counts(did).items()), []).append(did)
    for counts, dids in alike.items():
        title = (
            device_title(dids[0], robot)
            if len(dids) == 1
            else f"{len(dids)} devices: {', '.join(spans(dids))}"
        )
        rows.append(_device_row(text(title, limit=None), dict(counts), used))
    heads = "".join(f'<th scope="col" class="num">{sign(state)}</th>' for state in used)
    name = text(f"Devices of {node.name}: commands in each state")
    return (
        f'<div class="wide" role="region" tabindex="0" aria-label="{name}"><table class="list">'
        f"<caption>{name}</caption>"
        f'<thead><tr><th scope="col">Device</th>{heads}</tr></thead>\n<tbody>'
        f"{''.join(rows)}</tbody></table></div>\n"
    )


def _device_row(title: str, counts: Mapping[CellState, int], used: Sequence[CellState]) -> str:
    cells = "".join(f'<td class="num">{counts.get(state, "")}</td>' for state in used)
    return f'<tr><th scope="row">{title}</th>{cells}</tr>\n'


def device_map(
    node: NodeMap, did: int, robot: Robot | None, anchors: Mapping[tuple[int | None, int, int], str]
) -> str:
    """Return the map of a device.

    Args:
        node: its node.
        did: the device.
        robot: the model, None if it is not known.
        anchors: node, DID and CID -> the anchor of the finding.
    """
    title = text(device_title(did, robot))
    columns = "".join(f'<th scope="col">{low:x}</th>' for low in range(_SIDE))
    rows = []
    for row, high in enumerate(range(0, IDS, _SIDE)):
        cells = []
        for cid in range(high, high + _SIDE):
            start, shown = _CELLS[node.cells[did][cid]]
            anchor = anchors.get((node.target, did, cid))
            link = f'<a href="#{anchor}">{shown}</a>' if anchor else shown
            cells.append(f"{start}{link}</td>")
        rows.append(f'<tr><th scope="row">{row:x}</th>{"".join(cells)}</tr>\n')
    return (
        f'<article id="d-{node_key(node.target)}-{did:02x}"><h4>{title}</h4><table class="map">'
        f"<caption>{text(in_words(node.counts(did)))}</caption>"
        f'<thead><tr><th scope="col"><span aria-hidden="true">+</span></th>{columns}</tr></thead>\n'
        f"<tbody>{''.join(rows)}</tbody></table></article>\n"
    )
