"""The reference of a robot's commands in Markdown: what it answered, with what the catalogue knows of it."""

from itertools import groupby
from typing import Final, NamedTuple

from sphero_probe.catalogue import DEVICE_NAMES, lookup
from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.provenance import SOURCES, sources_for
from sphero_probe.probing.finding import Outcome
from sphero_probe.reports import address_phrases, phrases
from sphero_probe.reports import sweep_sections as words
from sphero_probe.reports.cell_states import CellState, NodeMap, node_maps
from sphero_probe.reports.finding_line import FindingLine
from sphero_probe.reports.ids import pair_spans
from sphero_probe.reports.markdown_page import MarkdownPage
from sphero_probe.reports.phrases import Data, hex_id, shown, spaced_hex
from sphero_probe.reports.run_blocked import blocked_by_reason
from sphero_probe.reports.run_heading import calibration_lines, heading_lines

_FRAME: Final = 3 * 256
"""The most characters of the bytes of a frame."""
_TOLD: Final = frozenset((CellState.EXISTS, CellState.NEW, CellState.SILENT, CellState.DOCUMENTED))
"""States of commands that have a section."""
_UNKNOWN: Final = "unknown"


class _Command(NamedTuple):
    """A command with a section.

    Attributes:
        node: of the robot.
        did: device id.
        cid: command id.
        line: the finding that tells most, None where the command was not asked.
        data: its row.
        others: further findings of the command, with other arguments.
    """

    node: NodeMap
    did: int
    cid: int
    line: FindingLine | None
    data: Data
    others: int


class ProtocolDocument(MarkdownPage):
    """Collects the rows of a run and writes the document at the end."""

    def close(self) -> None:
        """Write the document."""
        lines = self._rows.lines(in_order=False)
        if not lines:
            self._writer.paragraph(self._view.empty)
            return
        places = words.places(lines)
        self._heading(places)
        nodes = [
            node
            for node in node_maps(lines, self._rows.robot, partly=self._view.selection.filters)
            if node.name in places
        ]
        apart = len(nodes) > 1
        for node in nodes:
            for did, commands in groupby(self._commands(node), key=lambda command: command.did):
                where = f", node {self._safe(node.name)}" if apart else ""
                self._writer.heading(2, f"{hex_id(did)} {self._device(did)}{where}")
                for command in commands:
                    self._command(command)
        self._unknown(lines, nodes, apart=apart)

    def _heading(self, places: list[str]) -> None:
        heading = self._rows.heading
        who = f"{shown(heading.get('model'))} {shown(heading.get('device'))}" if heading else "a robot"
        self._writer.heading(1, f"Protocol of {self._safe(who)}")
        self._writer.paragraph(
            "The commands that the robot answered or left unanswered, and those that are documented for it "
            "in the same devices. Bytes, codes and times are from a recorded run. Names, layouts, risk "
            "classes and sources are from the catalogue of sphero-probe."
        )
        if heading:
            calibration = calibration_lines(self._rows.notes, self._rows.robot)
            self._writer.items(map(self._safe, heading_lines(heading, places, calibration)))

    def _commands(self, node: NodeMap) -> list[_Command]:
        """Return the commands of a node that have a section, by DID and CID."""
        found: dict[tuple[int, int], list[tuple[FindingLine, Data]]] = {}
        for line, data in self._rows.data(in_order=False):
            if line.target == node.target and data is not None:
                found.setdefault((line.did, line.cid), []).append((line, data))
        asked = {did for did, _ in found}
        commands = []
        for did, cid in sorted(found.keys() | {pair for pair in node.documented if pair[0] in asked}):
            if node.state(did, cid) in _TOLD:
                held = found.get((did, cid), [])
                if held:
                    line, data = min(held, key=_rank)
                    commands.append(_Command(node, did, cid, line, data, len(held) - 1))
                else:
                    commands.append(_Command(node, did, cid, None, {}, 0))
        return commands

    def _device(self, did: int) -> str:
        robot = self._rows.robot
        return (DEVICE_NAMES[robot.generation].get(did) if robot else None) or "unknown device"

    def _command(self, command: _Command) -> None:
        """Write the section of a command."""
        robot = self._rows.robot
        row = lookup(robot.generation, command.did, command.cid, robot) if robot else None
        name = row.name if row else shown(command.data.get("name"))
        ids = f"{hex_id(command.did)}:{hex_id(command.cid)}"
        self._writer.heading(3, f"{ids} {self._code(name) or 'unknown command'}")
        address = f" ({hex_id(command.node.target)})" if command.node.target is not None else ""
        risk = row.risk.word if row else f"{_UNKNOWN}, asked as {shown(command.data.get('risk'))}"
        told = [
            ("Node", f"{self._safe(command.node.name)}{address}"),
            ("Evidence", self._safe(self._evidence(command))),
            ("Risk", self._safe(risk)),
            ("Request", self._layout(row.request.text if row and row.request else None)),
            ("Response", self._layout(row.response.text if row and row.response else None)),
            ("Arguments", self._safe(phrases.arguments(command.data))),
            ("Sent", self._code(spaced_hex(command.data.get("sent")), limit=_FRAME)),
            ("Received", self._code(spaced_hex(command.data.get("received")), limit=_FRAME)),
            ("Answered by", self._safe(address_phrases.answered_by(command.data))),
            ("Decoded", self._safe(phrases.fields(command.data))),
            ("Sources", self._sources(row)),
            ("Also called", self._code(", ".join(row.aliases) if row else "")),
            ("Remark", self._safe("; ".join(filter(None, (row.note if row else "", _remark(command)))))),
        ]
        self._writer.items(f"{title}: {said}" for title, said in told if said)

    def _evidence(self, command: _Command) -> str:
        """Return what the run proved: the outcome, the code, the time, and on which firmware."""
        line, data = command.line, command.data
        if line is None:
            return "documented, not asked"
        firmware = (self._rows.heading or {}).get("firmware")
        version = shown(firmware.get(command.node.name)) if isinstance(firmware, dict) else ""
        if line.outcome == Outcome.SKIPPED:
            return "documented, not confirmed: it was blocked"
        outcome = f"maybe {line.outcome}" if line.maybe else line.outcome
        answer = f"code {line.code}" if line.code else phrases.outcome(data)
        time = "" if line.rtt_ms is None else f"after {line.rtt_ms:.1f} ms"
        said = " ".join(filter(None, (answer, time, f"on firmware {version}" if version else "")))
        return f"{outcome}: {said}"

    def _layout(self, layout: str | None) -> str:
        text = phrases.layout(layout)
        return text if text in (_UNKNOWN, "nothing") else self._code(text, limit=None)

    def _sources(self, row: CommandRow | None) -> str:
        robot = self._rows.robot
        if row is None or robot is None:
            return "none: no catalogue knows it"
        if robot.key not in row.nodes:
            return "none for this robot; the name is that of the same command on other robots"
        return "; ".join(SOURCES.get(source, source) for source in sources_for(row, robot.key))

    def _unknown(self, lines: list[FindingLine], nodes: list[NodeMap], *, apart: bool) -> None:
        """Write what the run did not settle."""
        self._writer.heading(2, "What is not known")
        blocked = blocked_by_reason((line for line in lines if line.name is None), self._times, apart=apart)
        told = [(f"blocked: {what}", ids) for what, ids in blocked]
        unsettled = [line for line in lines if line.outcome == Outcome.INCONCLUSIVE]
        told += [(f"inconclusive: {what}", ids) for what, ids in words.crowds(unsettled, apart=apart)]
        for node in nodes:
            where = f" on {node.name}" if apart else ""
            absent = _pairs(node, CellState.MISSING)
            told += [(f"documented, but absent{where}", pair_spans(absent))] if absent else []
            nameless = _pairs(node, CellState.NEW)
            told += [(f"name and layout unknown{where}", pair_spans(nameless))] if nameless else []
        if not told:
            self._writer.paragraph("Every command that was asked has a name and a settled result.")
        self._writer.items(
            f"{self._safe(what)}: {self._code(', '.join(ids), limit=None)}" for what, ids in told
        )


def _rank(finding: tuple[FindingLine, Data]) -> tuple[bool, bool]:
    """Order findings of one command: existing before others, a success before an error."""
    line, data = finding
    return (line.outcome != Outcome.EXISTS, data.get("code") != 0)


def _remark(command: _Command) -> str:
    said = command.line.note if command.line else ""
    others = f"{command.others} more findings with other arguments" if command.others else ""
    return "; ".join(filter(None, (said, others)))


def _pairs(node: NodeMap, state: CellState) -> list[tuple[int, int]]:
    return [
        (did, cid)
        for did, row in enumerate(node.cells)
        for cid in range(len(row))
        if node.state(did, cid) is state
    ]
