"""What a section of the benchmark is: options come in, lines and remarks come out.

A module of this folder that leaves a ``SECTION`` behind is found by ``python -m benchmarks``, its name is
what ``--only`` takes. What it needs that may not be installed is imported when it measures.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple


class Options(NamedTuple):
    """How thoroughly to measure.

    Attributes:
        quick: small inputs, so that all sections together take less than a minute.
        rounds: how often everything is timed; the medians are reported.
    """

    quick: bool
    rounds: int


class Ratio(NamedTuple):
    """How many times as long a peer takes: the middle of the rounds, and the middle half of them."""

    median: float
    low: float
    high: float


class Line(NamedTuple):
    """One thing measured.

    Attributes:
        what: the task.
        peer: beside whom, with the version where it has one.
        ratio: of times, or of whatever else is better when greater; None where nothing can be compared.
        bar: the least ratio that is aimed at, None where there is none.
        ceiling: the greatest one, where less is better.
        lost: what the peer lost or got wrong; such a line does not count for its bar.
        note: figures of this one run on this one machine, in words.
    """

    what: str
    peer: str
    ratio: Ratio | None
    bar: float | None = None
    lost: str = ""
    note: str = ""
    ceiling: float | None = None

    @property
    def verdict(self) -> str:
        """What the line says about its bar: ``met``, ``missed``, or nothing where it does not count."""
        if self.ratio is None or self.lost or (self.bar is None and self.ceiling is None):
            return ""
        too_small = self.bar is not None and self.ratio.median < self.bar
        too_great = self.ceiling is not None and self.ratio.median > self.ceiling
        return "missed" if too_small or too_great else "met"


class Remark(NamedTuple):
    """What has to be known to read the lines: what is simulated, which peer is not here."""

    text: str


class Section(NamedTuple):
    """A part of the benchmark.

    Attributes:
        name: one word, as ``--only`` takes it.
        summary: what is measured, in a line.
        measure: yields lines as they are measured, remarks before the lines that they concern.
    """

    name: str
    summary: str
    measure: Callable[[Options], Iterator[Line | Remark]]
