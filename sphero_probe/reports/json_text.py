"""Writes a row as one JSON object on one line, in ASCII and harmless on a terminal.

What many rows have in common is encoded once (``Row.keys``). Where orjson is installed, it writes lists of
numbers; the text is the same without it.
"""

import json
from collections.abc import Callable
from json.encoder import encode_basestring_ascii
from math import isfinite
from typing import Any, Final, NamedTuple

from sphero_probe.catalogue.packet_json import SharedKeys
from sphero_probe.reports.rows import Row

try:
    import orjson
except ImportError:
    dumps: Callable[[object], bytes] | None = None
else:
    dumps = orjson.dumps

SCHEMA_VERSION: Final = 2
"""Version of the keys and their meaning, in the first object of a document."""
_MOST: Final = 1024
"""The most templates that are remembered."""


_encode = json.JSONEncoder(allow_nan=False).encode  # json.dumps would make an encoder for every row


class _Template(NamedTuple):
    """The object of rows with the same keys.

    Attributes:
        text: with ``%s`` for every value that varies.
        encoded: places of the values that must be encoded; the others are written as they are.
    """

    text: str
    encoded: tuple[int, ...]


class JsonObjects:
    """Writes the rows of one document."""

    def __init__(self) -> None:
        self._templates: dict[SharedKeys, _Template] = {}
        self._first = True

    def text(self, row: Row) -> str:
        """Return the object of a row: its type, the schema's version in the first of a document, its data."""
        if row.keys and not self._first:
            text, encoded = self._templates.get(row.keys) or self._template(row, row.keys)
            values = [*row.values]
            for at in encoded:
                values[at] = _text(values[at])
            text %= tuple(values)
        else:
            version = {"schema_version": SCHEMA_VERSION} if self._first else {}
            text = _any_text({"type": row.type} | version | row.data)
            self._first = False
        return text.replace("\x7f", "\\u007f") if "\x7f" in text else text

    def _template(self, row: Row, keys: SharedKeys) -> _Template:
        if len(self._templates) >= _MOST:
            self._templates.clear()
        values = dict(zip(keys.varying, row.values, strict=True))
        pairs = [f'"type": {_literal(row.type)}']
        for name in keys.names:
            quoted = name in keys.simple and isinstance(values[name], str)
            value = _literal(keys.fixed[name]) if name in keys.fixed else '"%s"' if quoted else "%s"
            pairs.append(f"{_literal(name)}: {value}")
        encoded = tuple(at for at, name in enumerate(keys.varying) if name not in keys.simple)
        template = self._templates[keys] = _Template(f"{{{', '.join(pairs)}}}", encoded)
        return template


def _literal(value: object) -> str:
    return _text(value).replace("%", "%%")


def _text(value: Any) -> str:
    """Return any value as JSON, in the spelling of Python's encoder."""
    kind = type(value)  # a match would take twice as long
    if kind is str:
        return encode_basestring_ascii(value)
    if kind is int:
        return repr(value)
    if kind is list:
        return _list(value)
    if kind is float and isfinite(value):
        return repr(value)
    if kind is dict:
        try:
            pairs = [
                f"{encode_basestring_ascii(key)}: {_list(held) if type(held) is list else _text(held)}"
                for key, held in value.items()
            ]
        except TypeError:  # a key that is no text
            return _any_text(value)
        return f"{{{', '.join(pairs)}}}"
    return _any_text(value)


def _any_text(value: object) -> str:
    try:
        return _encode(value)
    except ValueError:
        return _encode(_finite(value))


def _list(values: list[Any]) -> str:
    """Return a list; orjson writes numbers as Python does, unless with an exponent or not finite."""
    if dumps:
        try:
            text = dumps(values).decode()
        except TypeError:  # a whole number of more than 64 bits, for example
            return _any_text(values)
        if not ("e" in text or "0.0000" in text or "n" in text or '"' in text):
            return text.replace(",", ", ")
    elif values and {*map(type, values)} == {float}:
        text = repr(values)
        if "n" not in text:
            return text
    return _any_text(values)


def _finite(value: object) -> object:
    """Return the value with numbers that JSON cannot hold as text: ``nan``, ``inf``, ``-inf``."""
    match value:
        case float() if not isfinite(value):
            return str(value)
        case dict():
            return {key: _finite(held) for key, held in value.items()}
        case list() | tuple():
            return [_finite(held) for held in value]
        case _:
            return value
