"""Print the nodes of a robot as a page: first the system, then a table of its nodes."""

from typing import TextIO

from sphero_probe.reports.nodes_page import LINE, write_nodes
from sphero_probe.reports.phrases import Data, shown
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.terminal import TerminalWriter


class NodesTable:
    """Collects the rows of a survey and writes the page at the end."""

    def __init__(self, out: TextIO, style: Style, nothing: str) -> None:
        self._writer = TerminalWriter(out, style)
        self._nothing = nothing
        self._system: Data | None = None
        self._nodes: list[Data] = []

    def add(self, row: Row) -> None:
        """Keep a row of a system or of an address."""
        if row.type == "system":
            self._system = row.data
        elif row.type == "node":
            self._nodes.append(row.data)

    def close(self) -> None:
        """Write the page."""
        if self._system is None:
            self._writer.say(self._nothing)
        else:
            who = filter(None, (shown(self._system.get("model")), shown(self._system.get("name"))))
            self._writer.say(f"{' '.join(who)}, over {shown(self._system.get('line'))}", limit=LINE)
            write_nodes(self._writer, self._system, self._nodes)
        self._writer.flush()
