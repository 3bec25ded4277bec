"""The page of a run in HTML: a summary, a map of each node and device, and every finding of interest."""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Final, TextIO

from sphero_probe.probing.notes import EXECUTED
from sphero_probe.reports import sweep_sections as words
from sphero_probe.reports.cell_states import STATES, CellState, NodeMap, node_maps
from sphero_probe.reports.differences import differences
from sphero_probe.reports.finding_line import FindingLine
from sphero_probe.reports.html.findings import Results, group_rows, results
from sphero_probe.reports.html.maps import KEYS, device_map, device_table, mapped_devices, overview, sign
from sphero_probe.reports.html.page import search_box, text, write_page
from sphero_probe.reports.phrases import Data, shown
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_heading import calibration_lines
from sphero_probe.reports.run_rows import RunRows
from sphero_probe.reports.views import View

_LINE: Final = 400
"""The most characters of a remark."""
_TIMES: Final = "\N{MULTIPLICATION SIGN}"
_HEADING: Final = {
    "model": "Robot",
    "device": "Name",
    "line": "Reached over",
    "firmware": "Firmware",
    "plan": "Plan",
    "consent": "Allowed",
    "started": "Started",
    "tool_version": "sphero-probe",
}
"""Key of the run's row -> what it is."""


class HtmlRun:
    """Collects the rows of a run and writes the page at the end."""

    def __init__(self, out: TextIO, view: View) -> None:
        self._out = out
        self._view = view
        self._rows = RunRows()

    def add(self, row: Row) -> None:
        """Keep a row of a run; rows of other types are left out."""
        self._rows.add(row)

    def close(self) -> None:
        """Write the page."""
        rows, in_order = self._rows, bool(self._view.selection.sort)
        lines = rows.lines(in_order=in_order)
        places = words.places(lines)
        nodes = node_maps(lines, rows.robot, partly=self._view.selection.filters)
        maps = [node for node in nodes if node.name in places]
        documented = {node.target: node.documented for node in nodes}
        findings = rows.data(in_order=in_order)
        if not in_order:
            findings.sort(key=lambda pair: (-1 if pair[0].target is None else pair[0].target, pair[0][2:4]))
        held = results(findings, documented, apart=len(places) > 1)
        heading = rows.heading or {}
        who = " ".join(filter(None, (shown(heading.get("model")), shown(heading.get("device")))))
        links = [("summary", "Summary")]
        links += [(f"node-{at}", f"Map of {node.name}") for at, node in enumerate(maps)]
        links.append(("findings", "Findings"))
        links += [("alike", "Commands with the same result")] if held.groups else []
        write_page(
            self._out,
            f"Commands of {who}" if who else "Findings",
            links,
            self._body(lines, maps, held, places),
            skip_to=len(maps) + 1,
        )

    def _body(
        self, lines: list[FindingLine], maps: list[NodeMap], held: Results, places: list[str]
    ) -> Iterator[str]:
        yield '<section id="summary" aria-labelledby="h-summary"><h2 id="h-summary">Summary</h2>\n'
        yield from self._summary(lines, maps)
        yield "</section>\n"
        for at, node in enumerate(maps):
            yield from self._node(at, node, held)
        apart = len(places) > 1
        yield from _findings(held, self._view.empty, apart=apart)
        if held.groups:
            yield from _alike(held, apart=apart)

    def _summary(self, lines: list[FindingLine], maps: list[NodeMap]) -> Iterator[str]:
        rows = self._rows
        for note in rows.notes_of(EXECUTED):
            yield f'<p class="alert"><strong>Executed:</strong> {text(note.get("text"), limit=_LINE)}</p>\n'
        for trouble in rows.troubles():
            yield f'<p class="alert">{text(trouble, limit=_LINE)}</p>\n'
        yield '<div class="columns">\n<div>'
        if rows.heading:
            yield _definitions(rows.heading)
        if rows.survey:
            yield f"<p>Nodes: {text(rows.survey.get('text'), limit=_LINE)}</p>\n"
        for line in calibration_lines(rows.notes, rows.robot):
            yield f"<p>Length check, {text(line, limit=_LINE)}</p>\n"
        if rows.summary:
            yield f"<p><strong>{text(words.ending(rows.summary, lines), limit=_LINE)}</strong></p>\n"
        yield "</div>\n"
        yield from _counts(maps, partly=self._view.selection.filters)
        yield "</div>\n"
        for note in rows.notes_of("comparison"):
            yield "<h3>Differences from the robot's own list and the catalogue</h3>\n"
            yield _named(differences(note))
        remarks = [
            *rows.selected,
            *words.doubts(lines),
            *words.remarks(rows.remarks, _TIMES),
            *rows.other_nodes,
        ]
        if remarks:
            yield "<h3>Remarks</h3>\n<ul>"
            yield "".join(f"<li>{text(remark, limit=_LINE)}</li>\n" for remark in remarks)
            yield "</ul>\n"

    def _node(self, at: int, node: NodeMap, held: Results) -> Iterator[str]:
        robot = self._rows.robot
        name = text(node.name)
        yield f'<section id="node-{at}" aria-labelledby="h-node-{at}">'
        yield f'<h2 id="h-node-{at}">Map of {name}</h2>\n<div class="columns">\n'
        yield from overview(node, robot)
        yield device_table(node, robot)
        yield "</div>\n"
        devices = mapped_devices(node)
        if devices:
            yield f"<h3>Devices of {name}</h3>\n"
            yield '<p class="quiet">Rows are the first hex digit of the command id, '
            yield 'columns the second. A sign with a finding leads to it.</p>\n<div class="cards">\n'
            for did in devices:
                yield device_map(node, did, robot, held.anchors)
            yield "</div>\n"
        yield "</section>\n"


def _definitions(heading: Data) -> str:
    pairs = (
        (title, text(value, limit=_LINE)) for key, title in _HEADING.items() if (value := heading.get(key))
    )
    return f"<dl>{''.join(f'<dt>{title}</dt><dd>{value}</dd>' for title, value in pairs)}</dl>\n"


def _counts(maps: Iterable[NodeMap], *, partly: bool) -> Iterator[str]:
    """Yield the number of commands in each state, which explains the signs.

    Args:
        maps: of the nodes.
        partly: findings were left out, so that a command without one may have been asked.
    """
    counts: Counter[CellState] = Counter()
    for node in maps:
        for did in range(len(node.cells)):
            counts.update(node.counts(did))
    yield '<table class="counts"><caption>Commands in each state, and the signs of the maps</caption>\n'
    yield '<thead><tr><th scope="col">Sign</th><th scope="col">State</th>'
    yield '<th scope="col" class="num">Commands</th></tr></thead>\n<tbody>'
    for state in STATES:
        word = f"{state.word}, or left out" if partly and state is CellState.NOT_ASKED else state.word
        yield f'<tr><td>{sign(state)}</td><th scope="row">{text(word)}</th>'
        yield f'<td class="num">{counts[state]}</td></tr>\n'
    yield "</tbody></table>\n"


def _named(told: Iterable[tuple[str, list[str]]]) -> str:
    """Return a list of titles, each with its ids."""
    items = (f"<li>{text(what)}: <code>{', '.join(ids)}</code></li>\n" for what, ids in told)
    return f"<ul>{''.join(items)}</ul>\n"


def _findings(held: Results, empty: str, *, apart: bool) -> Iterator[str]:
    yield '<section id="findings" aria-labelledby="h-findings"><h2 id="h-findings">Findings</h2>\n'
    if not held.rows and not held.groups:
        yield f"<p>{text(empty)}</p></section>\n"
        return
    states = [state for state in STATES if state in held.states]
    yield search_box((KEYS[state], f"{sign(state)} {text(state.word)}") for state in states)
    if held.cut:
        yield f'<p class="alert">{held.cut} findings are too many for this page. They share rows by their '
        yield "state; the format json has their details.</p>\n"
    if held.rows:
        node = '<th scope="col">Node</th>' if apart else ""
        yield f'<table class="list results"><caption>{len(held.rows)} findings, one in each row</caption>\n'
        yield f'<thead><tr>{node}<th scope="col">Command</th><th scope="col">State</th>'
        yield '<th scope="col">Answer</th><th scope="col" class="num">ms</th><th scope="col">Risk</th>'
        yield '<th scope="col">Bytes</th></tr></thead>\n<tbody>'
        yield from held.rows
        yield "</tbody></table>\n"
    yield "</section>\n"


def _alike(held: Results, *, apart: bool) -> Iterator[str]:
    yield '<section id="alike" aria-labelledby="h-alike">'
    yield '<h2 id="h-alike">Commands with the same result</h2>\n'
    total = sum(len(group.lines) for group in held.groups)
    node = '<th scope="col">Node</th>' if apart else ""
    yield f'<table class="list results"><caption>{total} findings</caption>\n<thead><tr>{node}'
    yield '<th scope="col">State</th><th scope="col">Result</th><th scope="col" class="num">Commands</th>'
    yield '<th scope="col">DID:CID</th></tr></thead>\n<tbody>'
    yield from group_rows(held.groups, apart=apart)
    yield "</tbody></table></section>\n"
