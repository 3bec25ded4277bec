"""Writes text, tables and lists in Markdown, so that untrusted text cannot become markup.

Markdown has no escape that works everywhere: ``@name``, ``#12`` and ``www.`` become links in an issue
whatever stands before them, and a pipe ends a cell also in a code span. So only plain words stay as they are.
All other text becomes a code span, and text with a backtick or a pipe becomes ``<code>`` with numeric
character references.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Final, TextIO

from sphero_probe.reports.printable import LIMIT, visible

_PLAIN: Final = re.compile(
    r"(?![0-9]+[.)] )[A-Za-z0-9](?:[A-Za-z0-9 ,.()%+\u00d7'\"?/-]|[:;] |:(?=0x[0-9a-f])|(?<=[0-9]):(?=[0-9])"
    r"|(?<=[A-Za-z0-9])_(?=[A-Za-z0-9]))*"
)
"""Words, numbers, ids and times, which mean nothing in Markdown."""
_WEB: Final = re.compile(r"www\.", re.IGNORECASE)
_KEPT: Final = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ")


def safe(text: str, *, limit: int | None = LIMIT, unicode: bool = True) -> str:
    """Return an untrusted text for the middle of a line or for a cell: as it is, or as code.

    Args:
        text: any text.
        limit: the most characters that are shown, None for all.
        unicode: False escapes everything that is not ASCII.
    """
    shown = visible(text, limit=limit, unicode=unicode)
    if not shown or (_PLAIN.fullmatch(shown) and not _WEB.search(shown)):
        return shown
    return code(text, limit=limit, unicode=unicode)


def code(text: str, *, limit: int | None = LIMIT, unicode: bool = True) -> str:
    """Return an untrusted text as code; empty for none."""
    shown = visible(text, limit=limit, unicode=unicode)
    if not shown.strip():
        return ""
    if "`" in shown or "|" in shown or shown[0] == " " or shown[-1] == " ":
        spelled = "".join(
            char if char in _KEPT or not char.isascii() else f"&#{ord(char)};" for char in shown.strip()
        )
        return f"<code>{spelled}</code>"
    return f"`{shown}`"


class MarkdownWriter:
    """Writes blocks of Markdown, each followed by an empty line.

    The arguments are Markdown: untrusted text has passed ``safe`` or ``code``.
    """

    def __init__(self, out: TextIO) -> None:
        self._out = out

    def heading(self, level: int, text: str) -> None:
        """Write a heading."""
        self._out.write(f"{'#' * level} {text}\n\n")

    def paragraph(self, text: str) -> None:
        """Write a paragraph."""
        self._out.write(f"{text}\n\n")

    def items(self, texts: Iterable[str]) -> None:
        """Write a list; nothing for no items."""
        lines = [f"- {text}\n" for text in texts]
        if lines:
            self._out.write("".join(lines) + "\n")

    def table(self, titles: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[bool] = ()) -> None:
        """Write a table without empty columns; nothing for no rows.

        Args:
            titles: of the columns.
            rows: the cells.
            right: which columns are aligned to the right; empty for none.
        """
        kept = [at for at in range(len(titles)) if any(row[at] for row in rows)]
        if not kept:
            return
        rules = ("---:" if right and right[at] else "---" for at in kept)
        self._line(titles[at] for at in kept)
        self._line(rules)
        for row in rows:
            self._line(row[at] for at in kept)
        self._out.write("\n")

    def _line(self, cells: Iterable[str]) -> None:
        self._out.write(f"| {' | '.join(cells)} |\n")
