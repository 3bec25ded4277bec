"""A page in Markdown that is written once all rows of a run are known."""

from functools import partial
from typing import Final, TextIO

from sphero_probe.reports.markdown_text import MarkdownWriter, code, safe
from sphero_probe.reports.registry import Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.run_rows import RunRows
from sphero_probe.reports.views import View

_LINE: Final = 400
"""The most characters of a heading or a remark."""


class MarkdownPage:
    """Collects the rows of a run; a subclass writes them in ``close``."""

    def __init__(self, out: TextIO, view: View, style: Style) -> None:
        self._writer = MarkdownWriter(out)
        self._view = view
        self._rows = RunRows()
        self._times = "\N{MULTIPLICATION SIGN}" if style.unicode else "x"
        self._safe = partial(safe, limit=_LINE, unicode=style.unicode)
        self._code = partial(code, unicode=style.unicode)

    def add(self, row: Row) -> None:
        """Keep a row of a run; rows of other types are left out."""
        self._rows.add(row)
