"""Lines of xxd, hexdump -C and od -t x1: their bytes, without offsets and without the text beside them."""

import re
from typing import Final

_XXD: Final = re.compile(
    r"([0-9a-f]{7,8}): ((?:[0-9a-f]{2}){1,2}(?: (?:[0-9a-f]{2}){1,2})*)(?:  .*)?\s*", re.IGNORECASE
)
_HEXDUMP: Final = re.compile(
    r"([0-9a-f]{7,8})  ((?:[0-9a-f]{2} {1,2})*[0-9a-f]{2})\s*(?:\|.*\|)?\s*", re.IGNORECASE
)
_OD: Final = re.compile(r"([0-9]{7})((?: +[0-9a-f]{2})+)\s*(?:>.*<)?\s*", re.IGNORECASE)
_END: Final = re.compile(r"[0-9a-f]{7,8}\s*", re.IGNORECASE)
_START: Final = re.compile(
    rb"(?:0{7,8}: [0-9a-fA-F]{2}|0{7,8}  [0-9a-fA-F]{2} |0{7} +[0-9a-fA-F]{2}(?: |\r?\n))"
)


def begins_as_dump(first: bytes) -> bool:
    """Whether a file begins as a dump does: with the offset 0."""
    return bool(_START.match(first.lstrip()))


def dumped_bytes(line: str) -> bytes | None:
    """Return the bytes of one line, none for the last line, which is an offset; None where it is no dump."""
    if found := _XXD.fullmatch(line) or _HEXDUMP.fullmatch(line) or _OD.fullmatch(line):
        return bytes.fromhex(found[2])
    return b"" if _END.fullmatch(line) else None
