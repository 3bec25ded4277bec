"""The live table of ``scan --watch``: it keeps the robots that were heard, and draws them."""

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple, Self, TextIO

from rich.cells import cell_len, set_cell_size
from rich.live import Live
from rich.text import Text

from sphero_probe.reports.printable import visible
from sphero_probe.reports.rows import robot_row
from sphero_probe.reports.terminal import live_console
from sphero_probe.transports.base import Seen

GONE_AFTER: Final = 10.0
"""Seconds of silence after which a robot counts as gone."""
_GAP: Final = 2
_LONGEST: Final = 40
"""Characters of a name or an address that are shown at most."""
_HINT: Final = "; Ctrl-C ends"


class _Column(NamedTuple):
    """One column, and how it shrinks on a narrow terminal.

    Attributes:
        title: its heading.
        least: the smallest width, unless it needs less.
        goes: when it is left out: 1 first, then 2, then 3; 0 never.
        right: aligned to the right.
    """

    title: str
    least: int
    goes: int = 0
    right: bool = False


_COLUMNS: Final = (
    _Column("Name", 8),
    _Column("Model", 8, goes=2),
    _Column("Protocol", 8, goes=1),
    _Column("Address", 17),
    _Column("dBm", 4, goes=3, right=True),
    _Column("Heard", len("gone 59 s")),
)


class Sighting(NamedTuple):
    """A robot, and when it was last heard, in seconds."""

    seen: Seen
    at: float


class Sightings:
    """The robots that were heard, one entry per address; callers pass the time."""

    def __init__(self) -> None:
        self._all: dict[str, Sighting] = {}
        self._told: dict[str, tuple[object, ...]] = {}

    def hear(self, seen: Seen, now: float) -> None:
        """Add a robot that is heard now."""
        self._all[seen.address] = Sighting(seen, now)

    def news(self) -> Iterator[Seen]:
        """Return the robots that appeared, or changed name, model or connection, since the last call."""
        for address, (seen, _) in self._all.items():
            told = seen._replace(rssi=None)
            if self._told.get(address) != told:
                self._told[address] = told
                yield seen

    def listed(self) -> list[Sighting]:
        """Return all robots, ordered by name alone: Spheros first, those without a name last."""
        return sorted(self._all.values(), key=_by_name)


def _by_name(sighting: Sighting) -> tuple[bool, bool, str, str]:
    seen = sighting.seen
    return (not seen.is_sphero, not seen.name, seen.name.casefold(), seen.address)


def page(
    sightings: Sequence[Sighting],
    now: float,
    *,
    width: int,
    height: int,
    unicode: bool = True,
    hint: str = _HINT,
) -> Text:
    """Return the table as of now, one line per robot, never larger than the terminal.

    Robots that do not fit are counted; those that are gone are left out first.

    Args:
        sightings: in the order in which they are listed.
        now: seconds, on the clock of the sightings.
        width: columns of the terminal.
        height: lines of the terminal.
        unicode: False keeps everything within ASCII.
        hint: what the last line ends with.
    """
    room = max(1, height - 4)  # titles, rule, count, and the line of the cursor
    gone = [sighting for sighting in sightings if _is_gone(sighting, now)]
    surplus = max(0, len(sightings) - room)
    left_out = {sighting.seen.address for sighting in gone[max(0, len(gone) - surplus) :]} if surplus else ()
    shown = [sighting for sighting in sightings if sighting.seen.address not in left_out][:room]
    table = _Table([_cells(sighting, now, unicode=unicode) for sighting in shown], width, unicode=unicode)
    lines = []
    if shown:
        rule = "─" if unicode else "-"
        titles = table.line([column.title for column in _COLUMNS])
        lines += [Text(titles, "bold"), Text(rule * min(width, table.width))]
    for sighting, cells in zip(shown, table.rows, strict=True):
        lines.append(Text(table.line(cells), "dim" if _is_gone(sighting, now) else ""))
    count = _count(sightings, len(gone), len(sightings) - len(shown)) + hint
    lines.append(Text(_clipped(count, width, unicode=unicode), "dim"))
    return Text("\n", no_wrap=True, overflow="crop").join(lines)


def _count(sightings: Sequence[Sighting], gone: int, left_out: int) -> str:
    if not sightings:
        return "listening, no robot heard yet"
    connected = sum(sighting.seen.connected for sighting in sightings)
    counts = (
        (len(sightings) - gone, "near"),
        (gone, "gone"),
        (left_out, "not shown"),
        (connected, "connected to this machine"),
    )
    return ", ".join(f"{number} {what}" for number, what in counts if number)


def _is_gone(sighting: Sighting, now: float) -> bool:
    return now - sighting.at > GONE_AFTER


def _cells(sighting: Sighting, now: float, *, unicode: bool) -> tuple[str, ...]:
    data = robot_row(sighting.seen).data
    raw = (data["name"], data["model"], data["generation"], data["address"], data["rssi"])
    texts = ("" if value is None else str(value) for value in raw)
    return (*(visible(text, limit=_LONGEST, unicode=unicode) for text in texts), _heard(sighting, now))


def _heard(sighting: Sighting, now: float) -> str:
    past = _duration(now - sighting.at)
    if _is_gone(sighting, now):
        return f"gone {past}"
    if sighting.seen.connected:
        return "connected"
    return f"{past} ago" if past else "now"


def _duration(seconds: float) -> str:
    """Return a time in its largest unit, empty below a second."""
    for size, unit in ((3600, "h"), (60, "min"), (1, "s")):
        if seconds >= size:
            return f"{seconds // size:.0f} {unit}"
    return ""


class _Table:
    """Visible cells in columns that fit a width.

    Attributes:
        rows: the cells.
        width: of the whole table.
    """

    def __init__(self, rows: Sequence[Sequence[str]], width: int, *, unicode: bool) -> None:
        self.rows = rows
        self._room = width
        self._unicode = unicode
        self._widths = [
            max([cell_len(column.title), *(cell_len(row[at]) for row in rows)])
            for at, column in enumerate(_COLUMNS)
        ]
        self._widths[-1] = max(
            self._widths[-1], _COLUMNS[-1].least
        )  # the table does not jump when a robot goes
        self._kept = list(range(len(_COLUMNS)))
        self._fit()
        self.width = self._total(self._widths)

    def line(self, cells: Sequence[str]) -> str:
        """Return the cells of a row as a line."""
        padded = []
        for at in self._kept:
            text = _clipped(cells[at], self._widths[at], unicode=self._unicode)
            blank = " " * (self._widths[at] - cell_len(text))
            padded.append(blank + text if _COLUMNS[at].right else text + blank)
        return _clipped((" " * _GAP).join(padded).rstrip(), self._room, unicode=self._unicode)

    def _fit(self) -> None:
        """Leave out columns, then narrow the widest, until the table fits."""
        least = [min(size, column.least) for size, column in zip(self._widths, _COLUMNS, strict=True)]
        for at in sorted((at for at in self._kept if _COLUMNS[at].goes), key=lambda at: _COLUMNS[at].goes):
            if self._total(least) > self._room:
                self._kept.remove(at)
        for _ in range(self._total(self._widths) - self._room):
            widest = max(self._kept, key=lambda at: self._widths[at] - least[at])
            if self._widths[widest] <= least[widest]:
                break
            self._widths[widest] -= 1

    def _total(self, widths: Sequence[int]) -> int:
        return sum(widths[at] for at in self._kept) + _GAP * (len(self._kept) - 1)


def _clipped(text: str, size: int, *, unicode: bool) -> str:
    """Return the text in at most so many columns; a longer one ends in an ellipsis."""
    if cell_len(text) <= size:
        return text
    ellipsis = "…" if unicode else "..."
    room = size - len(ellipsis)
    return set_cell_size(text, room).rstrip() + ellipsis if room > 0 else set_cell_size(text, max(0, size))


class LiveTable:
    """A table on a terminal that is redrawn in place; the last one stays on the screen."""

    def __init__(self, out: TextIO, *, color: bool, unicode: bool) -> None:
        self._console = live_console(out, color=color)
        self._unicode = unicode
        self._drawn: tuple[str, tuple[int, int]] | None = None
        self._last: tuple[Sequence[Sighting], float] | None = None
        self._live = Live(
            console=self._console,
            auto_refresh=False,
            redirect_stdout=False,
            redirect_stderr=False,
            vertical_overflow="crop",
        )

    def __enter__(self) -> Self:
        """Hide the cursor."""
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the last table on the screen, and show the cursor."""
        try:
            if self._last:
                self._live.update(self._page(*self._last, hint=""), refresh=True)
        finally:
            self._live.stop()

    def draw(self, sightings: Sequence[Sighting], now: float) -> None:
        """Draw the table as of now, if it differs from the one on the screen.

        Raises:
            OSError: the terminal is gone.
        """
        self._last = (sightings, now)
        text = self._page(sightings, now)
        look = (text.plain, self._console.size)
        if look != self._drawn:
            self._drawn = look
            self._live.update(text, refresh=True)

    def _page(self, sightings: Sequence[Sighting], now: float, hint: str = _HINT) -> Text:
        width, height = self._console.size
        return page(sightings, now, width=width, height=height, unicode=self._unicode, hint=hint)
