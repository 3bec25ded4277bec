"""Makes the rows of the results: one for each finding of interest, one for many findings that are alike."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

from sphero_probe.probing.finding import Outcome
from sphero_probe.reports import phrases
from sphero_probe.reports.cell_states import CellState, state_of
from sphero_probe.reports.finding_line import FindingLine
from sphero_probe.reports.html.maps import KEYS, node_key, sign
from sphero_probe.reports.html.page import BYTES_SHOWN, breakable, text
from sphero_probe.reports.ids import pair_spans
from sphero_probe.reports.phrases import Data, shown, spaced_hex

_ALIKE: Final = 8
"""Findings with the same result from which on they share a row."""
_ROOM: Final = 1_500_000
"""Characters of rows with one finding each; what is beyond shares rows, whatever the answers say."""
_MERGED: Final = frozenset((CellState.BLOCKED, CellState.INCONCLUSIVE, CellState.SILENT))
"""States of unknown commands that share rows; absent commands always do."""
Ids = tuple[int | None, int, int]
"""Node, DID, CID."""


class Group(NamedTuple):
    """Findings that share a row.

    Attributes:
        anchor: of the row.
        node: the node's name.
        state: what they prove.
        says: the answer in words, and the remark.
        lines: the findings.
    """

    anchor: str
    node: str
    state: CellState
    says: str
    lines: list[FindingLine]


class Results(NamedTuple):
    """The rows of a run.

    Attributes:
        rows: the markup of the rows with one finding.
        groups: the other findings.
        anchors: node, DID and CID -> the anchor of the row; without absent commands.
        states: the states that any row has.
        cut: findings that share a row only because there are too many.
    """

    rows: list[str]
    groups: list[Group]
    anchors: dict[Ids, str]
    states: set[CellState]
    cut: int


def results(
    findings: Iterable[tuple[FindingLine, Data | None]],
    documented: Mapping[int | None, frozenset[tuple[int, int]]],
    *,
    apart: bool,
) -> Results:
    """Return the rows of the findings, in the order given.

    Args:
        findings: each with its data, None for an absent command that no catalogue knows.
        documented: address byte of a node -> the commands that the catalogue lists for it.
        apart: name the node in each row.
    """
    held = [(line, data, _state(line, documented)) for line, data in findings]
    many: dict[tuple[object, ...], list[FindingLine]] = {}
    for line, _, state in held:
        if line.name is None and state in _MERGED:
            many.setdefault(_key(line, state), []).append(line)
    rows: list[str] = []
    anchors: dict[Ids, str] = {}
    groups: dict[tuple[object, ...], Group] = {}
    room, cut = _ROOM, 0
    for line, data, state in held:
        key = _key(line, state)
        ids = (line.target, line.did, line.cid)
        single = state is not CellState.ABSENT and len(many.get(key, ())) < _ALIKE
        if single and data is not None and room > 0:
            anchor = f"f-{node_key(line.target)}-{line.did:02x}-{line.cid:02x}"
            rows.append(_row(line, data, state, anchor if ids not in anchors else "", apart=apart))
            anchors.setdefault(ids, anchor)
            room -= len(rows[-1])
            continue
        cut += single
        key = (line.target, state, "details are left out") if single else key
        group = groups.get(key)
        if group is None:
            says = "details are left out" if single else _says(line)
            group = groups[key] = Group(f"g{len(groups)}", line.node, state, says, [])
        group.lines.append(line)
        if state is not CellState.ABSENT:
            anchors.setdefault(ids, group.anchor)
    return Results(rows, list(groups.values()), anchors, {state for _, _, state in held}, cut)


def _state(line: FindingLine, documented: Mapping[int | None, frozenset[tuple[int, int]]]) -> CellState:
    return state_of(line, documented=(line.did, line.cid) in documented.get(line.target, ()))


def _key(line: FindingLine, state: CellState) -> tuple[object, ...]:
    return (line.target, state, line.code, line.says, line.note)


def _says(line: FindingLine) -> str:
    answer = "" if line.outcome == Outcome.SKIPPED else line.says
    return "; ".join(filter(None, (answer, line.note)))


def _row(line: FindingLine, data: Data, state: CellState, anchor: str, *, apart: bool) -> str:
    """Return the row of one finding."""
    ids = f' id="{anchor}"' if anchor else ""
    node = f"<td>{text(line.node)}</td>" if apart else ""
    name = breakable(text(line.name)) if line.name is not None else "not in any catalogue"
    asked = data.get("sent") is not None
    answer = text(phrases.outcome(data)) if asked else ""
    arguments = f"<small>{text(line.arguments)}</small>" if line.arguments else ""
    note = f"<small>{text(line.note)}</small>" if line.note else ""
    time = "" if line.rtt_ms is None else f"{line.rtt_ms:.1f}"
    evidence = "".join(
        f"<code>{label} {text(spaced_hex(frame), limit=3 * BYTES_SHOWN)}</code>"
        for label, key in (("sent", "sent"), ("got", "received"))
        if (frame := shown(data.get(key)))
    )
    return (
        f'<tr{ids} data-s="{KEYS[state]}">{node}<th scope="row"><code>{line.pair}</code>'
        f'<span>{name}</span>{arguments}</th><td class="state">{sign(state)} {text(state.word)}</td>'
        f'<td class="answer">{answer}{note}</td><td class="num time">{time}</td>'
        f'<td class="risk">{text(data.get("risk"))}</td>'
        f'<td class="bytes">{evidence}</td></tr>\n'
    )


def group_rows(groups: Iterable[Group], *, apart: bool) -> Iterator[str]:
    """Yield the rows of the findings that share one."""
    for group in groups:
        node = f"<td>{text(group.node)}</td>" if apart else ""
        pairs = ", ".join(pair_spans((line.did, line.cid) for line in group.lines))
        yield (
            f'<tr id="{group.anchor}" data-s="{KEYS[group.state]}">{node}'
            f'<td class="state">{sign(group.state)} {text(group.state.word)}</td>'
            f'<td class="result">{text(group.says)}</td><td class="num many">{len(group.lines)}</td>'
            f'<td class="ids"><code>{pairs}</code></td></tr>\n'
        )
