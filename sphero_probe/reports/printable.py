r"""The output boundary: text from anywhere comes in, text that only shows what it says goes out.

What cannot be seen, or does something to a terminal instead of being seen, is spelled out: ``\n``, ``\x1b``,
``\u202e``, ``\U000e0041``. A backslash of the text itself is doubled only where it could be taken for the
start of such a spelling, so that every result can be read back in one way while ``C:\plans`` stays as it is.
"""

import re
from typing import Final
from unicodedata import category

LIMIT: Final = 200
"""Characters of a stranger's text that are shown where nothing else is asked for."""

_SHORT: Final = {"\t": r"\t", "\n": r"\n", "\r": r"\r"}
_STARTS: Final = frozenset("\\tnrxuU")
"""What may follow the backslash of a spelling of ours."""
_BLANK: Final = frozenset(
    (
        0x034F,  # combining grapheme joiner
        0x115F,  # Hangul fillers
        0x1160,
        0x3164,
        0xFFA0,
        0x17B4,  # Khmer inherent vowels
        0x17B5,
        *range(0x180B, 0x1810),  # Mongolian variation selectors
        0x2800,  # Braille blank
        *range(0xFE00, 0xFE10),  # variation selectors
        *range(0xE0100, 0xE01F0),
    )
)
"""Code points that count as printable and yet show nothing [Unicode: Default_Ignorable_Code_Point]."""
_MARKS: Final = frozenset(("Mn", "Me"))
_MARKS_IN_A_ROW: Final = 2
"""Combining marks that one character may carry; more of them climb into the lines above and below."""
_FORMULA: Final = frozenset("=+-@\uff1d\uff0b\uff0d\uff20")
_PLAIN_NUMBER: Final = re.compile(r"[+-]?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?", re.ASCII)


def visible(text: str, *, limit: int | None = LIMIT, unicode: bool = True) -> str:
    r"""Return the text with everything that is not plainly visible spelled out.

    Spelled out are control, format, surrogate, private and unassigned characters, every separator but the
    space, invisible letters, and combining marks beyond two in a row.

    Args:
        text: any text, lone surrogates included.
        limit: characters of the result; what is longer ends in an ellipsis. None for no limit.
        unicode: False spells out everything that is not ASCII, too.

    Returns:
        One line. No spelling is ever cut in two.
    """
    within = limit is None or len(text) <= limit
    if within and text.isascii() and text.isprintable() and "\\" not in text:
        return text
    pieces = _pieces(text if limit is None else text[: limit + 1], unicode=unicode)
    if limit is None or sum(map(len, pieces)) <= limit:
        return "".join(pieces)
    ellipsis = "…" if unicode else "..."
    room = max(0, limit - len(ellipsis))
    while pieces and sum(map(len, pieces)) > room:
        pieces.pop()
    return "".join(pieces) + ellipsis[:limit]


def csv_cell(text: str, *, unicode: bool = True) -> str:
    """Return the text as a spreadsheet may hold it: visible, uncut, and never a formula.

    What a spreadsheet would compute (``=``, ``+``, ``-``, ``@`` or a tab in front) gets a leading apostrophe,
    unless it is a plain number.
    """
    shown = visible(text, limit=None, unicode=unicode)
    risky = text[:1] in ("\t", "\r", "\n") or text.lstrip()[:1] in _FORMULA
    return f"'{shown}" if risky and not _PLAIN_NUMBER.fullmatch(text) else shown


def _pieces(text: str, *, unicode: bool) -> list[str]:
    """One piece per character, as it will be shown."""
    pieces: list[str] = []
    marks = 0
    for char in text:
        marks = marks + 1 if not char.isascii() and category(char) in _MARKS else 0
        seen = (
            char.isprintable()
            and ord(char) not in _BLANK
            and marks <= _MARKS_IN_A_ROW
            and (unicode or char.isascii())
        )
        pieces.append(char if seen else _spelled(char))
    following = [piece[0] for piece in pieces[1:]]
    return [
        r"\\" if piece == "\\" and after in _STARTS else piece
        for piece, after in zip(pieces, [*following, ""], strict=True)
    ]


def _spelled(char: str) -> str:
    number = ord(char)
    if char in _SHORT:
        return _SHORT[char]
    if number <= 0xFF:
        return f"\\x{number:02x}"
    return f"\\u{number:04x}" if number <= 0xFFFF else f"\\U{number:08x}"
