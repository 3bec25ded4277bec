"""The format ``html``: one file that needs no network and no script, written when all rows have arrived."""

from collections.abc import Iterator
from typing import TextIO

from sphero_probe.reports.html.page import search_box, text, write_page
from sphero_probe.reports.registry import Report, Style
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import FINDINGS, Column, View


class HtmlList:
    """Collects the view's rows and writes them at the end as a table."""

    def __init__(self, out: TextIO, view: View) -> None:
        self._out = out
        self._view = view
        self._rows: list[tuple[str, ...]] = []
        self._below = HtmlList(out, view.below) if view.below else None

    def add(self, row: Row) -> None:
        """Keep a row of the view's type, or of the view below it."""
        if self._below:
            self._below.add(row)
        if row.type == self._view.type:
            self._rows.append(tuple(column.render(row.data) for column in self._view.table_columns))

    def close(self) -> None:
        """Write the page."""
        name = self._view.type.replace("_", " ")
        title = f"sphero-probe: {name}{'es' if name.endswith('s') else 's'}"
        places = [("rows", "the list"), *([("below", "the list below it")] if self._below else [])]
        write_page(self._out, title, places, self._body())

    def _body(self) -> Iterator[str]:
        yield from self._list("rows")
        if self._below:
            yield from self._below._list("below")  # noqa: SLF001 - another of this class

    def _list(self, place: str) -> Iterator[str]:
        """Write the list, with an id that links can name."""
        if not self._rows:
            yield f'<p id="{place}">{text(self._view.empty)}</p>\n'
        elif self._view.upright:
            for at, row in enumerate(self._rows):
                yield "<dl>" if at else f'<dl id="{place}">'
                yield "".join(
                    f"<dt>{text(column.title)}</dt><dd>{text(cell, limit=None)}</dd>\n"
                    for column, cell in zip(self._view.table_columns, row, strict=True)
                    if cell
                )
                yield "</dl>\n"
        else:
            yield from self._table(place)

    def _table(self, place: str) -> Iterator[str]:
        columns = self._view.table_columns
        kept = [at for at in range(len(columns)) if any(row[at] for row in self._rows)]
        if place == "rows":
            yield search_box()
        yield f'<div class="wide"><table class="list" id="{place}"><caption>'
        yield f"{len(self._rows)} {'row' if len(self._rows) == 1 else 'rows'}</caption>\n<thead><tr>"
        yield "".join(f'<th scope="col">{text(columns[at].title)}</th>' for at in kept)
        yield "</tr></thead>\n<tbody>"
        starts = [f"<td{_class(columns[at])}>" for at in kept]
        for row in self._rows:
            cells = (
                f"{start}{text(row[at], limit=None)}</td>" for start, at in zip(starts, kept, strict=True)
            )
            yield f'<tr data-s="">{"".join(cells)}</tr>\n'
        yield "</tbody></table></div>\n"


def _class(column: Column) -> str:
    """Return the attribute of a cell that is aligned to the right, or never folded."""
    return ' class="num"' if column.right else ' class="whole"' if column.whole else ""


def report(out: TextIO, *, view: View, style: Style) -> Report:  # noqa: ARG001 - a page does not depend on the terminal
    """Open a report in this format."""
    if view.type == FINDINGS.type and not view.upright:
        from sphero_probe.reports.formats.html_run import HtmlRun  # noqa: PLC0415 - lists do without

        return HtmlRun(out, view)
    return HtmlList(out, view)
