"""Reads packets from a file or a pipe, as bytes or as hex text, piece by piece."""

import re
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Final

from sphero_probe.captures.source import Reads
from sphero_probe.cli.parse import odd_digits, two_readings
from sphero_probe.errors import BadInputFileError

CHUNK: Final = 1 << 14
"""Bytes of one read."""
_HEX_TEXT: Final = frozenset(b"0123456789abcdefABCDEFxX \t\r\n\f\v:,_")
_TO_BLANKS: Final = bytes.maketrans(b"\t\r\f\v:,_", b" " * 7)
_WRONG: Final = re.compile(rb"[^0-9a-fA-FxX \n]|(?<![ \n]0)(?<!^0)[xX]|[xX](?=[ \n])")
"""What is not hex text; an x is, between a 0 that begins a token and more digits."""
_UNCLEAR: Final = re.compile(
    rb"(?<![0-9a-fA-F])[0-9a-fA-F](?:[0-9a-fA-F]{2})+(?![0-9a-fA-F])"
    rb"|(?<![0-9a-fA-FxX])[0-9a-fA-F] *\n *[0-9a-fA-F](?![0-9a-fA-FxX])"
)
"""An odd number of digits above one; two digits with a line break between them, which may have cut a byte."""
_PLAIN: Final = b"0123456789abcdefABCDEF \n"
_GOOD_PREFIX: Final = re.compile(rb"(?<![^ \n])0[xX](?=[0-9a-fA-F])")
_PREFIX: Final = re.compile(rb"0[xX]")
_ONE_DIGIT: Final = re.compile(rb"(?<![0-9a-fA-F])([0-9a-fA-F])(?![0-9a-fA-F])")


_GAP: Final = 64
"""Blanks around a line break across which two digits may belong together."""


def is_hex_text(first: bytes) -> bool:
    """Whether the start of a file decides that it is hex text."""
    return bool(first) and _HEX_TEXT.issuperset(first)


def read_packets(file: Reads, name: str) -> Iterator[bytes]:
    """Yield a file's bytes as they arrive, hex text converted to bytes; ``b""`` at the end.

    The first chunk decides whether the whole file is read as hex text.

    Args:
        file: what to read.
        name: of the file, for messages.

    Raises:
        BadInputFileError: it begins as hex text, and then holds something else.
    """
    read = getattr(file, "read1", file.read)
    chunks = iter(lambda: read(CHUNK), b"")
    first = next(chunks, b"")
    if is_hex_text(first):
        yield from unhexed(chain((first,), chunks), name)
    else:
        yield first
        yield from chunks
    yield b""


def unhexed(texts: Iterable[bytes], name: str) -> Iterator[bytes]:
    """Yield the bytes that hex text stands for, wherever it was cut.

    Tokens are read as ``hex_bytes`` reads them. Most of a long token is yielded before its end is known.

    Args:
        texts: the pieces of the text.
        name: of the file, for messages.

    Raises:
        BadInputFileError: something in it is not hexadecimal, or may stand for different bytes: a token with
            an odd number of digits, or a lone digit on either side of a line break.
    """
    offset = 0  # in the file, of the text at hand
    held = b""  # what a piece ended in: a lone digit, and a token or its last two or three digits
    for piece in chain(texts, (b"\n",)):
        text = held + piece.translate(_TO_BLANKS)
        wrong = _WRONG.search(text) if _GOOD_PREFIX.sub(b"", text).translate(None, _PLAIN) else None
        sound = text[: wrong.start()] if wrong else text
        token = max(sound.rfind(b" "), sound.rfind(b"\n")) + 1
        cut = token if wrong else _before_digit(sound, token)
        yield from _tokens(sound[:token], cut, name, offset)
        held = sound[cut:]
        if cut == token:
            digits = _PREFIX.sub(b"", held)
            keep = len(digits) % 2 + (0 if wrong else 2)
            if len(digits) > keep:
                held = digits[len(digits) - keep :]
                yield bytes.fromhex(digits[: len(digits) - keep].decode())
        if wrong:
            raise BadInputFileError(
                f"{name}: byte 0x{wrong[0][0]:02x} at offset {offset + wrong.start()} is not hexadecimal",
                "hex text holds only hex digits, blanks, colons, commas, underscores and 0x",
            )
        offset += len(text) - len(held)
    yield from _tokens(held, len(held), name, offset)


def _before_digit(text: bytes, token: int) -> int:
    """Return where to cut a piece: before its last token, or before a lone digit in front of it.

    The digit and a token of at most one digit so far may be a byte that a line break has cut.
    """
    near = max(0, token - _GAP)
    words = text[near:token].split()
    if not words or len(words[-1]) > 1 or len(text) - token > 1:
        return token
    digit = text.rindex(words[-1], near, token)
    return digit if not digit or text[digit - 1] in b" \n" else token


def _tokens(tokens: bytes, cut: int, name: str, offset: int) -> Iterator[bytes]:
    """Yield the bytes of whole tokens up to a cut.

    Raises:
        BadInputFileError: a token, also one behind the cut, may stand for different bytes.
    """
    try:
        whole = bytes.fromhex(_PREFIX.sub(b"", tokens).decode())
    except ValueError:
        unclear = _UNCLEAR.search(tokens)
        padded = _ONE_DIGIT.sub(rb"0\1", _PREFIX.sub(b"", tokens[: unclear.start() if unclear else cut]))
        if whole := bytes.fromhex(padded.decode()):
            yield whole
        if unclear:
            digits = b"".join(unclear[0].split()).decode()
            said = odd_digits(digits) if len(digits) > 2 else f"a line break may have cut the byte '{digits}'"
            raise BadInputFileError(
                f"{name}: {said} at offset {offset + unclear.start()}", two_readings(digits)
            ) from None
    else:
        if whole:
            yield whole
