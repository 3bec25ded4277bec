"""The page of a comparison in Markdown: whether robots or firmwares differ, then the differences by kind."""

from functools import partial
from typing import Final, TextIO

from sphero_probe.reports.diff_rows import ending, robot_words, warnings
from sphero_probe.reports.diff_sections import TITLES, DiffPage
from sphero_probe.reports.markdown_text import MarkdownWriter, safe
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row

_LINE: Final = 400
"""The most characters of a heading."""


class MarkdownDiff:
    """Collects the rows of a comparison and writes the page at the end."""

    def __init__(self, out: TextIO, style: Style) -> None:
        self._writer = MarkdownWriter(out)
        self._page = DiffPage()
        self._safe = partial(safe, limit=_LINE, unicode=style.unicode)
        self._cell = partial(safe, limit=None, unicode=style.unicode)

    def add(self, row: Row) -> None:
        """Keep a row of a comparison."""
        self._page.add(row)

    def close(self) -> None:
        """Write the page."""
        page, writer = self._page, self._writer
        for text in warnings(page.head):
            writer.paragraph(f"**{self._safe(text)}**")
        sides = ((title, robot_words(page.head.get(key))) for title, key in (("A", "before"), ("B", "after")))
        writer.items(f"{title}: {self._safe(words)}" for title, words in sides if words)
        for section in page.sections():
            writer.heading(3, section.title)
            writer.table(TITLES, [list(map(self._cell, cells)) for cells in section.rows])
        for title, reasons in page.uncertain():
            writer.heading(3, title)
            writer.items(f"{reason}: {self._cell(', '.join(ids))}" for reason, ids in reasons)
        if page.counts:
            writer.paragraph(f"{ending(page.counts)}.")
