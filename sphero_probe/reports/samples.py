"""Combines the values of sensor streams into samples: one row with every value that was asked for."""

from collections.abc import Iterable, Mapping
from typing import Final

from sphero_probe.catalogue.stream_plan import StreamColumn
from sphero_probe.reports.phrases import shown
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import Column, View

SAMPLE: Final = "sample"
_SECONDS: Final = "seconds"


class Samples:
    """Collects values until one arrives a second time: then a sample is complete.

    A robot with several nodes, or several tokens, sends the values of one sample in several notifications.
    """

    def __init__(self, columns: Iterable[StreamColumn]) -> None:
        self._units = {column.name: column.unit for column in columns}
        self._values: dict[str, object] = {}
        self._began: float | None = None
        self._at = 0.0
        self._time = ""

    def add(self, fields: Mapping[str, object], now: float, time: str) -> Row | None:
        """Take the values of a notification; return the sample before it, if that is complete.

        Args:
            fields: name -> value.
            now: when it arrived, in seconds of any clock.
            time: the same as text, for the row.
        """
        wanted = {name: fields[name] for name in self._units if name in fields}
        if not wanted:
            return None
        done = self.end() if self._values.keys() & wanted.keys() else None
        if not self._values:
            self._began = now if self._began is None else self._began
            self._at = now - self._began
            self._time = time
        self._values |= wanted
        if len(self._values) < len(self._units):
            return done
        return done or self.end()

    def end(self) -> Row | None:
        """Return the sample that is being collected, None where there is none."""
        if not self._values:
            return None
        values, self._values = self._values, {}
        data: dict[str, object] = {"time": self._time, _SECONDS: round(self._at, 3)}
        data["values"] = {name: values.get(name) for name in self._units}
        return Row(SAMPLE, data | {"units": {name: unit for name, unit in self._units.items() if unit}})


def sample_view(columns: Iterable[StreamColumn]) -> View:
    """Return the columns of a list of samples: the time, then one for each value, with its unit."""
    made = [Column("time [s]", "Time", lambda data: f"{_number(data.get(_SECONDS)):.3f}", right=True)]
    made += [_value_column(column) for column in columns]
    return View(SAMPLE, tuple(made), "No sample arrived.")


def _value_column(column: StreamColumn) -> Column:
    title = f"{column.name} [{column.unit}]" if column.unit else column.name

    def render(data: Mapping[str, object]) -> str:
        values = data.get("values")
        return shown(values.get(column.name)) if isinstance(values, dict) else ""

    return Column(title, title, render, right=True)


def _number(value: object) -> float:
    return value if isinstance(value, int | float) else 0.0
