"""The table of a comparison: whether robots or firmwares differ, then the differences by kind."""

from typing import Final, TextIO

from sphero_probe.reports.diff_rows import ending, robot_words, warnings
from sphero_probe.reports.diff_sections import TITLES, DiffPage
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.terminal import Shape, TerminalWriter

_SHAPES: Final = tuple(Shape(title, whole=title in ("DID:CID", "Node")) for title in TITLES)
_LINE: Final = 400
"""The most characters of a heading."""


class DiffTable:
    """Collects the rows of a comparison and writes the page at the end."""

    def __init__(self, out: TextIO, style: Style) -> None:
        self._writer = TerminalWriter(out, style)
        self._page = DiffPage()

    def add(self, row: Row) -> None:
        """Keep a row of a comparison."""
        self._page.add(row)

    def close(self) -> None:
        """Write the page."""
        page, writer = self._page, self._writer
        for text in warnings(page.head):
            writer.say(text, "bold yellow", limit=_LINE)
        for title, key in (("A", "before"), ("B", "after")):
            if words := robot_words(page.head.get(key)):
                writer.say(f"{title}: {words}", limit=_LINE)
        sections = page.sections()
        widths = writer.widths(_SHAPES, [cells for section in sections for cells in section.rows])
        for at, section in enumerate(sections):
            writer.skip()
            writer.say(section.title, "bold")
            writer.grid(_SHAPES, section.rows, widths, heading=not at)
        for title, reasons in page.uncertain():
            writer.skip()
            writer.say(title, "bold")
            for reason, ids in reasons:
                writer.say(f"{reason}:", indent=2)
                writer.items(ids, indent=6)
        if page.counts:
            writer.skip()
            writer.say(ending(page.counts), "bold")
        writer.flush()
