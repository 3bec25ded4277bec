"""The table of a fleet: its robots, and below them the commands in which they differ."""

from typing import Final, TextIO

from sphero_probe.reports.registry import Report, Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.terminal import TerminalWriter

_MATRIX: Final = "matrix"


class FleetTable:
    """Writes two lists; of the matrix, only the rows that differ, unless all are wanted."""

    def __init__(self, robots: Report, matrix: Report, out: TextIO, style: Style) -> None:
        self._robots = robots
        self._matrix = matrix
        self._out = out
        self._style = style
        self._differing = self._alike = 0

    def add(self, row: Row) -> None:
        """Take a row of either list."""
        if row.type != _MATRIX:
            self._robots.add(row)
            return
        differs = row.data.get("differs") is True
        self._differing += differs
        self._alike += not differs
        if differs or self._style.detail:
            self._matrix.add(row)

    def close(self) -> None:
        """Write the page."""
        self._robots.close()
        if not self._differing + self._alike:
            return
        self._out.write("\n")
        writer = TerminalWriter(self._out, self._style)
        if self._differing:
            many = "1 command" if self._differing == 1 else f"{self._differing} commands"
            writer.say(f"The robots differ in {many}:", "bold")
        if self._differing or self._style.detail:
            writer.flush()
            self._matrix.close()
            writer = TerminalWriter(self._out, self._style)
        if not self._style.detail and self._alike:
            hint = f"Not shown: {self._alike} commands in which they agree; --detail lists them."
            writer.say(hint, "dim")
        writer.flush()
