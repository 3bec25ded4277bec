"""The results of the ``cli`` fixture, and helpers to read them."""

import json
from collections.abc import Callable
from typing import Any, NamedTuple


class Ran(NamedTuple):
    code: int
    out: str
    err: str


Cli = Callable[..., Ran]


def objects(text: str) -> list[dict[str, Any]]:
    """The JSON objects in a text with one per line."""
    return [json.loads(line) for line in text.splitlines()]
