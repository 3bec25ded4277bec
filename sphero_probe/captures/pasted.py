"""Bytes as people paste them: lists, literals, dumps of other languages; what is no such form gives None.

Every token is a byte or whole bytes. What may stand for different bytes is an error that says so.
"""

import re
from typing import Final

from sphero_probe.errors import UsageError

_PAIRS: Final = re.compile(r"(?:\(0x\)|0x)?\s*[0-9a-f]{2}(?:\s*-\s*[0-9a-f]{2})+", re.IGNORECASE)
_ESCAPES: Final = re.compile(r"\\x[0-9a-f]{2}", re.IGNORECASE)
_LITERAL: Final = re.compile(r"""^(?:bytearray\()?b?(["'])(.*)\1\)?[;,]?$""", re.DOTALL)
_IN_LITERAL: Final = re.compile(r"\\x([0-9a-fA-F]{2})|\\(.)|([ -~])", re.DOTALL)
_ONE_LETTER: Final = {"t": 9, "n": 10, "r": 13, "0": 0, "a": 7, "b": 8, "f": 12, "v": 11}
_ANGLES: Final = re.compile(r"<\s*(?:Buffer\s+|ByteArray\s+)?((?:0x)?[0-9a-f][0-9a-f\s]*)>", re.IGNORECASE)
_DATA: Final = re.compile(r"\{?\s*length\s*=\s*\d+,\s*bytes\s*=\s*0x([0-9a-f\s]+)\}?", re.IGNORECASE)
_LIST: Final = re.compile(r"[\w.]*\s*(?:\(\d*\)\s*)?\(?[\[{(]([^\[\]{}()]*)[\]})]\)?[;,]?")
_DECIMAL: Final = re.compile(r"-?\d{1,3}")
_HEX: Final = re.compile(r"(?:0x)?([0-9a-f]+)", re.IGNORECASE)
_NOTHING_BUT_HEX: Final = re.compile(r"(?:0x)?[0-9a-f]+(?:[\s,;:_]+(?:0x)?[0-9a-f]+)*[,;]?", re.IGNORECASE)


def pasted_bytes(text: str) -> bytes | None:
    r"""Return the bytes of one pasted form, None where the text is none.

    The forms are ``8D-09-13``, ``(0x) 8D-09``, ``[141, 9, 19]``, ``[-115, 9]``, ``[0x8d, 0x09]``,
    ``{0x8d, 9}``, ``bytes([141, 9])``, ``<8d0913 0d>``, ``<Buffer 8d 09>``, ``{length = 2, bytes = 0x8d09}``,
    ``\x8d\x09`` and ``b'\x8d\t'``, and plain hex tokens.

    Raises:
        UsageError: it may stand for different bytes, or a number is no byte.
    """
    text = text.strip()
    if _PAIRS.fullmatch(text):
        return bytes.fromhex(re.sub(r"\(0x\)|0x|[\s-]", "", text, flags=re.IGNORECASE))
    if _ESCAPES.search(text):
        return _literal(text)
    if found := _ANGLES.fullmatch(text) or _DATA.fullmatch(text):
        return _tokens(found[1].split())
    if _NOTHING_BUT_HEX.fullmatch(text):
        return _tokens(re.split(r"[\s,;:_]+", text))
    if found := _LIST.fullmatch(text):
        words = re.split(r"[\s,;]+", found[1].strip(" \t\r\n,;"))
        return _listed(words) if words != [""] else None
    return None


def _literal(text: str) -> bytes | None:
    quoted = _LITERAL.match(text)
    inner = quoted[2] if quoted else text.strip(" ,;\"'")
    data = bytearray()
    at = 0
    while at < len(inner):
        found = _IN_LITERAL.match(inner, at)
        if not found:
            return None
        at = found.end()
        if found[1]:
            data.append(int(found[1], 16))
        elif found[2]:
            data.append(_ONE_LETTER.get(found[2], ord(found[2]) & 0xFF))
        elif quoted or found[3] not in " ,":
            if not quoted:
                return None
            data.append(ord(found[3]))
    return bytes(data)


def _listed(words: list[str]) -> bytes | None:
    """Return the bytes of a list: decimal as programs print them, unless something in it is hexadecimal."""
    if all(_DECIMAL.fullmatch(word) for word in words):
        numbers = [int(word) for word in words]
        if wrong := next((number for number in numbers if not -128 <= number <= 255), None):
            raise UsageError(f"{wrong} in a list is no byte", "bytes are 0 to 255")
        if all(len(word) == 2 and word[0] != "-" for word in words):
            shown = ", ".join(words[:4])
            raise UsageError(
                f"[{shown}] may be decimal or hexadecimal",
                f"write {', '.join('0x' + word for word in words[:4])}",
            )
        return bytes(number & 0xFF for number in numbers)
    if not all(_HEX.fullmatch(word) or _DECIMAL.fullmatch(word) for word in words):
        return None
    if any(word[:2] in {"0x", "0X"} for word in words):
        numbers = [_number(word) for word in words]
        return bytes(numbers) if all(0 <= number <= 255 for number in numbers) else None
    return _tokens(words)


def _number(word: str) -> int:
    try:
        return int(word, 0)
    except ValueError:
        return -1


def _tokens(words: list[str]) -> bytes:
    data = bytearray()
    for word in filter(None, words):
        digits = re.sub(r"^0[xX]", "", word)
        if len(digits) % 2 and len(digits) > 1:
            raise UsageError(f"'{word[:16]}' has an odd number of hex digits", "write each byte with two")
        data += bytes.fromhex(digits.zfill(2))
    return bytes(data)
