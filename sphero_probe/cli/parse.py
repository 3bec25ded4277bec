"""Parses hex bytes that were typed."""

import re
from typing import Final

from sphero_probe.errors import UsageError

HEX_SEPARATOR: Final = re.compile(r"[\s:_,]+")
HEX_TOKEN: Final = re.compile(r"(?:0[xX])?([0-9a-fA-F]+)")
_SHOWN: Final = 16
"""Characters of a wrong token that a message shows."""


def hex_bytes(text: str, what: str) -> bytes:
    """Return the bytes that a text of hex tokens stands for.

    Blanks, colons, commas and underscores separate tokens, and each token stands for whole bytes: ``0102``,
    ``01 02``, ``0x01 0x02`` and ``1 2`` are the same. A token of one digit is one byte.

    Args:
        text: the tokens.
        what: the text's name, for messages.

    Raises:
        UsageError: it is not hexadecimal, or a token of several digits has an odd number of them.
    """
    read = bytearray()
    for token in HEX_SEPARATOR.split(text):
        match = HEX_TOKEN.fullmatch(token)
        if match is None:
            if token:
                raise UsageError(
                    f"{what}: '{token[:_SHOWN]}' is not hexadecimal", "write bytes as 00ff or 0x00ff"
                )
            continue
        digits = match[1]
        if len(digits) % 2 and len(digits) > 1:
            raise UsageError(f"{what}: {odd_digits(token)}", two_readings(digits))
        read += bytes.fromhex(digits.zfill(2))
    return bytes(read)


def odd_digits(token: str) -> str:
    """Return what is wrong with a token that has an odd number of digits."""
    shown = token if len(token) <= _SHOWN else f"{token[:_SHOWN]}..."
    return f"'{shown}' has an odd number of hex digits"


def two_readings(digits: str) -> str:
    """Return the hint for digits that may stand for different bytes: which ones."""
    if len(digits) > _SHOWN:
        return "a digit is missing, or there is one too many"
    if len(digits) == 2:
        return f"write 0{digits[0]} 0{digits[1]} or {digits}"
    first, last = bytes.fromhex(f"0{digits}"), bytes.fromhex(f"{digits[:-1]}0{digits[-1]}")
    return f"write {first.hex(' ')} or {last.hex(' ')}"


def is_hex(text: str) -> bool:
    """Whether a text can only be meant as hex bytes, valid or not."""
    return bool(text) and all(HEX_TOKEN.fullmatch(token) for token in HEX_SEPARATOR.split(text) if token)
