"""A chart of samples as one SVG picture: a panel for each unit, a line for each value."""

from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite
from typing import Final, NamedTuple

from sphero_probe.catalogue.stream_plan import StreamColumn
from sphero_probe.reports.rows import Row

_WIDTH, _PANEL, _LEFT, _RIGHT, _TOP, _GAP = 960, 220, 70, 190, 30, 50
"""Pixels: the picture, a panel, its margins, the space between panels."""
_COLOURS: Final = ("#0b6aa2", "#b3471d", "#2c7a3f", "#7a3e9d", "#8a6d00", "#a01f5b")
_DASHES: Final = ("", "7 3", "2 3", "9 3 2 3", "1 5", "12 4")
"""Each line has a dash of its own beside its colour."""
_STYLE: Final = (
    "text{font:12px sans-serif;fill:#222}.t{font-weight:bold}.a{stroke:#888;fill:none}.g{stroke:#ddd}"
    "@media(prefers-color-scheme:dark){svg{background:#16181d}text{fill:#ddd}.g{stroke:#333}}"
)


class _Scale(NamedTuple):
    """Maps a range of values to pixels."""

    low: float
    high: float
    start: float
    end: float

    def at(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return round(self.start + share * (self.end - self.start), 1)


def chart(title: str, columns: Sequence[StreamColumn], samples: Iterable[Row]) -> str:
    """Return the picture as the text of an SVG file; it needs nothing else.

    Args:
        title: above the panels.
        columns: the values to draw.
        samples: the rows of the samples.
    """
    points = _points(columns, samples)
    panels: dict[str, list[StreamColumn]] = {}
    for column in columns:
        panels.setdefault(column.unit, []).append(column)
    last = max((at for line in points.values() for at, _ in line), default=0.0) or 1.0
    height = _TOP + len(panels) * (_PANEL + _GAP) + 10
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" role="img">',
        f"<title>{escape(title)}</title>",
        f"<style>{_STYLE}</style>",
        f'<text class="t" x="{_LEFT}" y="20">{escape(title)}</text>',
    ]
    for number, (unit, held) in enumerate(panels.items()):
        parts += _panel(unit, held, points, last, _TOP + 15 + number * (_PANEL + _GAP))
    return "\n".join((*parts, "</svg>", ""))


def _points(columns: Sequence[StreamColumn], samples: Iterable[Row]) -> dict[str, list[tuple[float, float]]]:
    """Return name -> its (seconds, value)."""
    points: dict[str, list[tuple[float, float]]] = {column.name: [] for column in columns}
    for row in samples:
        seconds, values = row.data.get("seconds"), row.data.get("values")
        if not isinstance(values, dict) or not isinstance(seconds, int | float):
            continue
        for name, value in values.items():
            if name in points and isinstance(value, int | float) and isfinite(value):
                points[name].append((seconds, value))
    return points


def _panel(
    unit: str,
    columns: Sequence[StreamColumn],
    points: dict[str, list[tuple[float, float]]],
    last: float,
    top: int,
) -> list[str]:
    values = [value for column in columns for _, value in points[column.name]] or [0.0]
    low, high = min(values), max(values)
    margin = (high - low) * 0.05 or abs(high) * 0.05 or 1.0
    x = _Scale(0, last, _LEFT, _WIDTH - _RIGHT)
    y = _Scale(low - margin, high + margin, top + _PANEL, top)
    parts = [f'<rect class="a" x="{x.start}" y="{top}" width="{x.end - x.start}" height="{_PANEL}"/>']
    for step in range(5):
        value = y.low + (y.high - y.low) * step / 4
        second = last * step / 4
        parts += [
            f'<line class="g" x1="{x.start}" x2="{x.end}" y1="{y.at(value)}" y2="{y.at(value)}"/>',
            f'<text x="{x.start - 6}" y="{y.at(value) + 4}" text-anchor="end">{value:.4g}</text>',
            f'<text x="{x.at(second)}" y="{top + _PANEL + 16}" text-anchor="middle">{second:.3g} s</text>',
        ]
    for number, column in enumerate(columns):
        colour, dash = _COLOURS[number % len(_COLOURS)], _DASHES[number % len(_DASHES)]
        line = " ".join(f"{x.at(at)},{y.at(value)}" for at, value in points[column.name])
        look = f'fill="none" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dash}"'
        label = top + 14 + 18 * number
        name = f"{column.name} [{unit}]" if unit else column.name
        parts += [
            f'<polyline {look} points="{line}"><title>{escape(name)}</title></polyline>',
            f'<line {look} x1="{x.end + 8}" x2="{x.end + 32}" y1="{label - 4}" y2="{label - 4}"/>',
            f'<text x="{x.end + 38}" y="{label}">{escape(name)}</text>',
        ]
    return parts
