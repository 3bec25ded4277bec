"""Rows as JSON: a row comes in, one object on one line comes out, in ASCII and harmless on a terminal."""

import json
from math import isfinite
from typing import Final

from sphero_probe.reports.rows import Row

SCHEMA_VERSION: Final = 2
"""Of the rows' keys and their meaning; stands in the first object of a document."""


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
    """The same value with numbers that JSON does not know as texts: ``nan``, ``inf``, ``-inf``."""
    match value:
        case float() if not isfinite(value):
            return str(value)
        case dict():
            return {key: _finite(held) for key, held in value.items()}
        case list() | tuple():
            return [_finite(held) for held in value]
        case _:
            return value
