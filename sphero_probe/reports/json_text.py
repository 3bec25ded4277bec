"""Writes a row as one JSON object on one line, in ASCII and harmless on a terminal."""

import json
from math import isfinite
from typing import Final

from sphero_probe.reports.rows import Row

SCHEMA_VERSION: Final = 2
"""Version of the keys and their meaning, in the first object of a document."""


_encode = json.JSONEncoder(allow_nan=False).encode  # json.dumps would make an encoder for every row


def object_text(row: Row, *, first: bool) -> str:
    """Return the object of a row: its type, the schema's version in the first of a document, its data."""
    if first:
        whole = {"type": row.type, "schema_version": SCHEMA_VERSION} | row.data
    else:
        whole = {"type": row.type, **row.data}
    try:
        text = _encode(whole)
    except ValueError:
        text = _encode(_finite(whole))
    return text.replace("\x7f", "\\u007f") if "\x7f" in text else text


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
