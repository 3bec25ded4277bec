"""The types of options that take an age or a date."""

import re
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    _AgeType = click.ParamType[timedelta, Any]
    _DateType = click.ParamType[datetime, Any]
else:
    _AgeType = _DateType = click.ParamType  # generic only in newer releases of click

_AGE: Final = re.compile(r"([0-9]{1,5})(h|d|w)")
_UNITS: Final = {"h": "hours", "d": "days", "w": "weeks"}


class Age(_AgeType):
    """An age: ``12h``, ``30d``, ``4w``."""

    name = "age"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> timedelta:
        """Return the age that a text stands for."""
        if isinstance(value, timedelta):
            return value
        found = _AGE.fullmatch(value.strip())
        if not found:
            self.fail(f"'{value}' is not an age; write it as 12h, 30d or 4w", param, ctx)
        return timedelta(**{_UNITS[found[2]]: int(found[1])})


class Date(_DateType):
    """A date or time in UTC, ``2026-11-26`` or ``2026-11-26T08:00Z``, or an age before now, ``7d``."""

    name = "date"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> datetime:
        """Return the time that a text stands for."""
        if isinstance(value, datetime):
            return value
        if _AGE.fullmatch(value.strip()):
            try:
                return datetime.now(UTC) - Age().convert(value, param, ctx)
            except OverflowError:
                self.fail(f"'{value}' is before all dates", param, ctx)
        try:
            told = datetime.fromisoformat(value.strip())
        except ValueError:
            self.fail(f"'{value}' is not a date; write it as 2026-11-26, or as an age: 7d", param, ctx)
        return told if told.tzinfo else told.replace(tzinfo=UTC)
