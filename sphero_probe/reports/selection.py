"""Chooses and sorts the findings that a report shows."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple, TypeVar

from sphero_probe.probing.finding import Outcome
from sphero_probe.reports.phrases import Data, shown
from sphero_probe.reports.rows import Row

SORTS: Final = ("did", "outcome", "time", "rtt")
"""By what findings can be sorted."""
_Record = TypeVar("_Record")
_RANK: Final = {outcome.value: rank for rank, outcome in enumerate(Outcome)}


class Selection(NamedTuple):
    """Which findings are shown, and in which order.

    Attributes:
        outcomes: only these, empty for all.
        dids: only these devices, None for all.
        nodes: only these address bytes, with None for commands without an address; None for all.
        unknown: only commands that no catalogue knows.
        sort: a word of ``SORTS``; empty for the order of the run.
    """

    outcomes: frozenset[str] = frozenset()
    dids: frozenset[int] | None = None
    nodes: frozenset[int | None] | None = None
    unknown: bool = False
    sort: str = ""

    @property
    def filters(self) -> bool:
        """Whether findings are left out."""
        return bool(self.outcomes or self.unknown) or self.dids is not None or self.nodes is not None

    @property
    def flat(self) -> bool:
        """Whether the order goes across devices, so that a page cannot group findings by device."""
        return self.sort in ("time", "rtt")

    def accepts(self, data: Data) -> bool:
        """Whether a finding is shown."""
        return (
            (not self.outcomes or data.get("outcome") in self.outcomes)
            and (self.dids is None or data.get("did") in self.dids)
            and (self.nodes is None or data.get("target") in self.nodes)
            and not (self.unknown and data.get("name") is not None)
        )

    def key(self, data: Data) -> tuple[float, ...]:
        """Return the place of a finding in the order: ``rtt`` starts with the slowest answer."""
        ids = (_number(data, "target"), _number(data, "did"), _number(data, "cid"))
        match self.sort:
            case "did":
                return ids
            case "outcome":
                return (_RANK.get(shown(data.get("outcome")), len(_RANK)), *ids)
            case "rtt":
                return (-_number(data, "rtt_ms"), *ids)
            case _:
                return (_number(data, "number"),)


def select(
    records: Sequence[_Record], row_of: Callable[[_Record], Row], selection: Selection, *, page: bool
) -> Iterator[Row]:
    """Yield the rows that a report shows.

    Rows are made twice instead of kept, because those of a whole robot would fill the memory.

    Args:
        records: of a run, in order.
        row_of: makes the row of a record.
        selection: which findings.
        page: the format is for people, so the run and its notes are shown too, and how many findings are
            left out. Other formats get findings only.
    """
    chosen: list[tuple[tuple[float, ...], int]] = []
    total = 0
    others: list[tuple[int, Row]] = []
    for at, record in enumerate(records):
        row = row_of(record)
        if row.type == "finding":
            total += 1
            if selection.accepts(row.data):
                chosen.append((selection.key(row.data), at))
        elif page and not (selection.filters and row.data.get("kind") == "comparison"):
            others.append((at, row))
    if selection.sort:
        chosen.sort()
    ending = [row for _, row in others if row.type == "summary"]
    yield from (row for _, row in others if row.type != "summary")
    yield from (row_of(records[at]) for _, at in chosen)
    if page and selection.filters:
        text = f"{len(chosen)} of {total} findings are shown"
        yield Row("note", {"kind": "selection", "text": text})
    yield from ending


def _number(data: Data, key: str) -> float:
    value = data.get(key)
    return value if isinstance(value, int | float) else -1
