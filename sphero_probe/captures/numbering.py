"""Numbers of connections, in order of appearance; a line that is opened again is another connection."""

from typing import Final

from sphero_probe.captures.events import Line

_MAX_CONNECTIONS: Final = 1 << 10


class Numbering:
    """The open connections and their numbers.

    Attributes:
        count: the last number.
    """

    def __init__(self) -> None:
        """Know no connection yet."""
        self.count = 0
        self._open: dict[Line, int] = {}

    def of(self, line: Line) -> tuple[int, int | None]:
        """Return the number of a line's connection, and the number of the one that is forgotten for it."""
        known = self._open.get(line)
        if known is not None:
            return known, None
        forgotten = None
        if len(self._open) >= _MAX_CONNECTIONS:
            forgotten = self._open.pop(next(iter(self._open)))
        self.count += 1
        self._open[line] = self.count
        return self.count, forgotten

    def end(self, line: Line) -> int | None:
        """Return the number of the connection that ends here, None where the line has none."""
        return self._open.pop(line, None)
