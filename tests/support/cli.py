"""What the ``cli`` fixture gives, and how to read it."""

import json
from collections.abc import Callable
from typing import Any, NamedTuple


class Ran(NamedTuple):
    code: int
    out: str
    err: str


Cli = Callable[..., Ran]


def objects(text: str) -> list[dict[str, Any]]:
    """The JSON objects in a text of one a line."""
    return [json.loads(line) for line in text.splitlines()]
