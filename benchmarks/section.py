"""The types of a benchmark section: its options, its results and itself.

``python -m benchmarks`` finds every module of this folder that defines ``SECTION``; ``--only`` takes its
name. A section imports packages that may not be installed only while it measures.
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
    """How many times as long a peer takes: the median of the rounds, and the quartiles."""

    median: float
    low: float
    high: float


class Line(NamedTuple):
    """One thing measured.

    Attributes:
        what: the task.
        peer: what it is compared with, with a version if there is one.
        ratio: of times, or of another measure where more is better; None if nothing can be compared.
        bar: the target, a minimum for the ratio; None if there is none.
        ceiling: the maximum for the ratio, where less is better.
        lost: what the peer lost or got wrong; then the target does not count.
        note: figures of this run on this machine, as text.
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
        """Whether the target is ``met`` or ``missed``, or an empty string if it does not count."""
        if self.ratio is None or self.lost or (self.bar is None and self.ceiling is None):
            return ""
        too_small = self.bar is not None and self.ratio.median < self.bar
        too_great = self.ceiling is not None and self.ratio.median > self.ceiling
        return "missed" if too_small or too_great else "met"


class Remark(NamedTuple):
    """A remark on the results: what is simulated, which peer is not installed."""

    text: str


class Section(NamedTuple):
    """A part of the benchmark.

    Attributes:
        name: one word, as ``--only`` takes it.
        summary: what is measured, in one line.
        measure: yields results as they are measured, each remark before its results.
    """

    name: str
    summary: str
    measure: Callable[[Options], Iterator[Line | Remark]]
