"""Lays out raw lines and cells in the width of a terminal, in colour if wanted.

All text passes ``printable.visible`` here, and none of it is read as markup. Long cells are folded, never
cut: at blanks, else after ``_ . , / : -``, else inside a word.
"""

import re
from collections.abc import Iterable, Sequence
from io import StringIO
from typing import Final, NamedTuple, TextIO

from rich.box import Box
from rich.cells import cell_len, chop_cells
from rich.console import Console
from rich.table import Table
from rich.text import Text

from sphero_probe.reports.printable import visible
from sphero_probe.reports.registry import Style

NARROWEST: Final = 60
"""The least width of a page."""
GAP: Final = 2
"""Columns between two columns of a grid."""
_LEAST: Final = 8
"""Columns that each foldable cell gets in any case."""
_JOINT: Final = re.compile(r"(?<=[_.,/:-])")
_RULE: Final = "    \n    \n -- \n    \n    \n    \n    \n    \n"


class Shape(NamedTuple):
    """One column of a grid.

    Attributes:
        title: its heading.
        right: aligned to the right.
        whole: its cells are never folded.
        look: a style by the names of rich, empty for none.
    """

    title: str
    right: bool = False
    whole: bool = False
    look: str = ""


class TerminalWriter:
    """Collects a page, and writes it at the end."""

    def __init__(self, out: TextIO, style: Style) -> None:
        self.width = max(style.width, NARROWEST)
        self.unicode = style.unicode
        self._out = out
        self._page = StringIO()
        self._console = Console(
            file=self._page,
            width=self.width,
            height=25,
            force_terminal=style.color,
            color_system="standard" if style.color else None,
            no_color=not style.color,
            force_jupyter=False,
            legacy_windows=False,
            markup=False,
            emoji=False,
            highlight=False,
            _environ={},
        )
        self._box = Box(_RULE.replace("-", "─") if style.unicode else _RULE, ascii=not style.unicode)

    def say(self, text: str, look: str = "", *, indent: int = 0, limit: int | None = None) -> None:
        """Write a paragraph; all lines but the first are indented by two columns.

        Args:
            text: raw.
            look: a style by the names of rich.
            indent: columns before the first line.
            limit: the most characters to show, None for all.
        """
        shown = visible(text, limit=limit, unicode=self.unicode)
        lines = fold(shown, self.width - indent - GAP)
        for number, line in enumerate(lines):
            self._print(line, indent + (GAP if number else 0), look)

    def items(self, items: Iterable[str], *, indent: int) -> None:
        """Write raw items with commas between them, breaking lines between items where possible."""
        room = self.width - indent
        line = ""
        for item in items:
            shown = self._visible(item)
            joined = f"{line}, {shown}" if line else shown
            if line and cell_len(joined) + 1 > room:
                self._print(line + ",", indent)
                joined = shown
            *full, line = fold(joined, room - 1)
            for part in full:
                self._print(part, indent)
        if line:
            self._print(line, indent)

    def skip(self) -> None:
        """Write an empty line, unless the page is empty so far."""
        if self._page.tell():
            self._console.print()

    def widths(self, shapes: Sequence[Shape], rows: Iterable[Sequence[str]]) -> list[int]:
        """Return the width of each column for these raw rows: what it needs, or a fair share."""
        needs = [cell_len(shape.title) for shape in shapes]
        for row in rows:
            for at, cell in enumerate(row):
                needs[at] = max(needs[at], cell_len(self._visible(cell)))
        room = self.width - GAP * (len(shapes) - 1)
        whole = sorted((at for at, shape in enumerate(shapes) if shape.whole), key=lambda at: needs[at])
        while whole and room - sum(needs[at] for at in whole) < _LEAST * (len(shapes) - len(whole)):
            whole.pop()  # a cell that is longer than expected
        room -= sum(needs[at] for at in whole)
        foldable = sorted(set(range(len(shapes))).difference(whole), key=lambda at: needs[at])
        for rank, at in enumerate(foldable):
            needs[at] = max(1, min(needs[at], room // (len(foldable) - rank)))
            room -= needs[at]
        return needs

    def grid(
        self,
        shapes: Sequence[Shape],
        rows: Iterable[Sequence[str]],
        widths: Sequence[int],
        *,
        heading: bool = True,
    ) -> None:
        """Write raw rows in columns of the given widths, under their titles if wanted."""
        table = Table(
            box=self._box if heading else None,
            show_header=heading,
            show_edge=False,
            pad_edge=False,
            padding=(0, GAP - 1, 0, 0) if heading else (0, GAP, 0, 0),
            header_style="bold",
        )
        for shape, width in zip(shapes, widths, strict=True):
            table.add_column(
                Text("\n".join(fold(shape.title, width))),
                justify="right" if shape.right else "left",
                style=shape.look,
                width=width,
                no_wrap=True,
            )
        for row in rows:
            cells = zip(row, widths, strict=True)
            table.add_row(*(Text("\n".join(fold(self._visible(cell), width))) for cell, width in cells))
        self._console.print(table)

    def flush(self) -> None:
        """Write the page to the stream.

        Raises:
            OSError: the stream cannot be written.
        """
        for line in self._page.getvalue().split("\n")[:-1]:
            self._out.write(line.rstrip(" ") + "\n")

    def _print(self, line: str, indent: int, look: str = "") -> None:
        self._console.print(Text(" " * indent + line, style=look))

    def _visible(self, cell: str) -> str:
        return visible(cell, limit=None, unicode=self.unicode)


def live_console(out: TextIO, *, color: bool) -> Console:
    """Return the console of a page that is redrawn in place."""
    return Console(
        file=out,
        force_terminal=True,
        force_jupyter=False,
        color_system="standard" if color else None,
        markup=False,
        emoji=False,
        highlight=False,
    )


def fold(text: str, width: int) -> list[str]:
    """Return the text in lines of at most ``width`` columns."""
    if cell_len(text) <= width:
        return [text]
    lines = [""]
    for word in text.split(" "):
        if cell_len(lines[-1]) + 1 + cell_len(word) <= width and lines != [""]:
            lines[-1] += " " + word
            continue
        if lines != [""]:
            lines.append("")
        lines[-1:] = _fold_word(word, width)
    return lines


def _fold_word(word: str, width: int) -> list[str]:
    """Return a word in lines: whole if it fits, else broken after its joints, else anywhere."""
    if cell_len(word) <= width:
        return [word]
    lines = [""]
    for part in _JOINT.split(word):
        if cell_len(lines[-1]) + cell_len(part) <= width:
            lines[-1] += part
        else:
            lines += chop_cells(part, width)
    return lines if lines[0] else lines[1:]
