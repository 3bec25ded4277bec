r"""Escapes what is invisible in a text or would control a terminal. All output passes through here.

Escapes look like ``\n``, ``\x1b``, ``\u202e``, ``\U000e0041``. A backslash of the text itself is doubled only
where it could be read as the start of an escape: every result can be read back in one way, and ``C:\plans``
stays as it is.
"""

import re
from typing import Final
from unicodedata import category

LIMIT: Final = 200
"""Characters of untrusted text that are shown by default."""

_SHORT: Final = {"\t": r"\t", "\n": r"\n", "\r": r"\r"}
_STARTS: Final = frozenset("\\tnrxuU")
"""What may follow the backslash of an escape."""
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
"""Combining marks that one character may have; more would reach into the lines above and below."""
_FORMULA: Final = frozenset("=+-@\uff1d\uff0b\uff0d\uff20")
_PLAIN_NUMBER: Final = re.compile(r"[+-]?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?", re.ASCII)


def visible(text: str, *, limit: int | None = LIMIT, unicode: bool = True) -> str:
    r"""Return the text with everything that is not plainly visible escaped.

    Escaped are control, format, surrogate, private and unassigned characters, every separator but the
    space, invisible letters, and combining marks beyond two in a row.

    Args:
        text: any text, lone surrogates included.
        limit: characters of the result; a longer one ends in an ellipsis. None for no limit.
        unicode: False also escapes everything that is not ASCII.

    Returns:
        One line. An escape is never cut in two.
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
    """Return the text for a spreadsheet: visible, complete, and never a formula.

    Text that a spreadsheet would compute (``=``, ``+``, ``-``, ``@`` or a tab in front) gets a leading
    apostrophe, unless it is a plain number.
    """
    if not text or (text.isalnum() and text.isascii()):
        return text
    shown = visible(text, limit=None, unicode=unicode)
    risky = text[:1] in ("\t", "\r", "\n") or text.lstrip()[:1] in _FORMULA
    return f"'{shown}" if risky and not _PLAIN_NUMBER.fullmatch(text) else shown


def _pieces(text: str, *, unicode: bool) -> list[str]:
    """Return one piece per character, as it is shown."""
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
