"""The type of options that take a time."""

import re
from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    _TimeType = click.ParamType[float, Any]
else:
    _TimeType = click.ParamType  # generic only in newer releases of click

_TIME: Final = re.compile(r"([0-9]+(?:\.[0-9]*)?|\.[0-9]+)(ms|s|m|min|)")
_UNITS: Final = {"ms": 0.001, "s": 1.0, "": 1.0, "m": 60.0, "min": 60.0}


class Seconds(_TimeType):
    """A time within bounds: ``500ms``, ``2s``, ``1m`` or plain seconds."""

    name = "time"

    def __init__(self, least: float, most: float) -> None:
        """Take the bounds, in seconds."""
        self.least, self.most = least, most

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the seconds that a text stands for; a default is a number already."""
        if isinstance(value, float):
            return value
        found = _TIME.fullmatch(value.strip())
        if not found:
            self.fail(f"'{value}' is not a time; write it as 500ms, 2s, 1m or plain seconds", param, ctx)
        seconds = float(found[1]) * _UNITS[found[2]]
        if not self.least <= seconds <= self.most:
            self.fail(f"'{value}' is not between {_spell(self.least)} and {_spell(self.most)}", param, ctx)
        return seconds


def _spell(seconds: float) -> str:
    """Write seconds as a person types them."""
    if seconds < 1:
        return f"{seconds * 1000:g}ms"
    return f"{seconds:g}s" if seconds < 60 else f"{seconds / 60:g}m"
