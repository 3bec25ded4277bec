"""Writes a row as one JSON object on one line, in ASCII and harmless on a terminal.

What many rows share is encoded once (``Row.shared``). Where orjson is installed, it writes lists of numbers;
the text is the same without it.
"""

import json
from collections.abc import Callable, Mapping
from json.encoder import encode_basestring_ascii
from math import isfinite
from typing import Any, Final, NamedTuple

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
    """The object of rows that share most of their data.

    Attributes:
        text: with ``%s`` for every value that is not shared.
        varying: the keys of these values.
        shared: what the rows share; it is kept, so that its id stays its own.
    """

    text: str
    varying: tuple[str, ...]
    shared: Mapping[str, object]


class JsonObjects:
    """Writes the rows of one document."""

    def __init__(self) -> None:
        self._templates: dict[tuple[str, int, tuple[str, ...]], _Template] = {}
        self._first = True

    def text(self, row: Row) -> str:
        """Return the object of a row: its type, the schema's version in the first of a document, its data."""
        first, self._first = self._first, False
        if row.shared and not first:
            text = self._templated(row)
        else:
            version = {"schema_version": SCHEMA_VERSION} if first else {}
            text = _any_text({"type": row.type} | version | row.data)
        return text.replace("\x7f", "\\u007f") if "\x7f" in text else text

    def _templated(self, row: Row) -> str:
        data = row.data
        key = (row.type, id(row.shared), tuple(data))
        template = self._templates.get(key)
        if template is None:
            if len(self._templates) >= _MOST:
                self._templates.clear()
            template = self._templates[key] = _template(row)
        return template.text % tuple([_text(data[name]) for name in template.varying])


def _template(row: Row) -> _Template:
    varying = tuple(key for key in row.data if key not in row.shared)
    pairs = []
    for key, value in ({"type": row.type} | row.data).items():
        known = key not in varying
        pairs.append(f"{_literal(key)}: {_literal(value) if known else '%s'}")
    return _Template(f"{{{', '.join(pairs)}}}", varying, row.shared)


def _literal(value: object) -> str:
    return _text(value).replace("%", "%%")


def _text(value: Any) -> str:
    """Return any value as JSON, in the spelling of Python's encoder."""
    kind = type(value)  # a match would take twice as long
    if kind is str:
        return encode_basestring_ascii(value)
    if kind is int:
        return repr(value)
    if kind is list and {*map(type, value)} == {float}:
        return _numbers(value)
    if kind is dict and {*map(type, value)} == {str}:
        pairs = [f"{encode_basestring_ascii(key)}: {_text(held)}" for key, held in value.items()]
        return f"{{{', '.join(pairs)}}}"
    return _any_text(value)


def _any_text(value: object) -> str:
    try:
        return _encode(value)
    except ValueError:
        return _encode(_finite(value))


def _numbers(values: list[float]) -> str:
    """Return a list of floats; orjson writes some differently: with an exponent, or not finite."""
    if dumps:
        text = dumps(values).decode()
        if not ("e" in text or "0.0000" in text or "n" in text):
            return text.replace(",", ", ")
    text = repr(values)
    return _encode(_finite(values)) if "n" in text else text


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
