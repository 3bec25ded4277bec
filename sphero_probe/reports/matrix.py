"""The matrix of commands and robots: which robot and firmware has which command, over many runs."""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Final

from sphero_probe.probing.finding import Outcome
from sphero_probe.reports.phrases import Data, hex_id, shown
from sphero_probe.reports.printable import visible
from sphero_probe.reports.rows import Row
from sphero_probe.reports.states import BLOCKED
from sphero_probe.reports.views import Column, Place, View, both, record_only, table_only

NOT_ASKED: Final = "not asked"
_SIGNS: Final = {
    Outcome.EXISTS.value: "+",
    Outcome.ABSENT.value: "-",
    Outcome.SILENT.value: "~",
    Outcome.INCONCLUSIVE.value: "?",
    BLOCKED: "x",
    NOT_ASKED: ".",
}
"""The first word of a state -> its sign; every other state has no sign."""
_WIDE: Final = 4
"""Robots above which a table shows signs under numbers, with a legend."""
_MOST: Final = 14
"""Robots that such a table shows at most."""
_STRENGTH: Final = (Outcome.EXISTS.value, Outcome.ABSENT.value, Outcome.SILENT.value)
"""States by what they prove, the strongest first."""

_Pair = tuple[int, int]


class Matrix:
    """Collects the findings of runs; add the runs newest first."""

    def __init__(self) -> None:
        self._columns: dict[str, dict[_Pair, str]] = {}
        self._names: dict[_Pair, str] = {}

    def add(self, robot: str, findings: Iterable[Data]) -> None:
        """Add a run.

        Args:
            robot: model and firmware, the title of the column.
            findings: the data of rows of findings.
        """
        of_run: dict[_Pair, str] = {}
        for data in findings:
            did, cid = data.get("did"), data.get("cid")
            if isinstance(did, int) and isinstance(cid, int):
                state = shown(data.get("state"))
                if _strength(state) > _strength(of_run.get((did, cid))):
                    of_run[did, cid] = state
                if name := shown(data.get("name")):
                    self._names.setdefault((did, cid), name)
        if of_run:
            column = self._columns.setdefault(visible(robot), {})
            for pair, state in of_run.items():
                if not _decides(column.get(pair)) and _strength(state) > _strength(column.get(pair)):
                    column[pair] = state

    @property
    def view(self) -> View:
        """The view of the matrix: one column per robot and firmware."""
        titles = sorted(self._columns)
        many = len(titles) > _WIDE
        listed = titles[:_MOST] if many else titles
        return View(
            "matrix",
            (
                *record_only("did", "cid", show=hex_id),
                table_only("DID:CID", _pair_text, whole=True),
                both("name"),
                *record_only("differs"),
                table_only("Differs", lambda data: "yes" if data.get("differs") else ""),
                *(Column(title, title, partial(_state, title), Place.RECORD) for title in titles),
                *(
                    table_only(str(number), partial(_sign, title), whole=True)
                    if many
                    else table_only(title, partial(_signed, title))
                    for number, title in enumerate(listed, 1)
                ),
            ),
            "No run has asked this.",
            legend=lambda _: _legend(listed, len(titles)) if many else (),
        )

    def rows(self) -> list[Row]:
        """Return a row for each command: those in which robots differ first, then by id."""
        pairs = sorted({pair for column in self._columns.values() for pair in column})
        rows = [self._row(pair) for pair in pairs]
        return sorted(rows, key=lambda row: not row.data["differs"])

    def _row(self, pair: _Pair) -> Row:
        states = {title: self._columns[title].get(pair, NOT_ASKED) for title in sorted(self._columns)}
        differs = len({_word(state) for state in states.values() if _decides(state)}) > 1
        did, cid = pair
        data: dict[str, object] = {"did": did, "cid": cid, "name": self._names.get(pair), "differs": differs}
        return Row("matrix", data | {"states": states})


def is_had(row: Row) -> bool:
    """Whether any robot has the command of a row."""
    states = row.data["states"]
    return isinstance(states, dict) and any(_word(state) == Outcome.EXISTS.value for state in states.values())


def column_title(model: str, firmware: Mapping[str, str]) -> str:
    """Return the title of a robot's column: its model and the versions of its nodes."""
    return " ".join(filter(None, (model or "unknown model", "/".join(dict.fromkeys(firmware.values())))))


def _legend(listed: list[str], total: int) -> list[str]:
    """Return what the numbers and signs of a wide matrix stand for; the lines sort in this order."""
    signs = ", ".join(f"{sign} {word}" for word, sign in _SIGNS.items())
    lines = [f"{number:>3}  {title}" for number, title in enumerate(listed, 1)]
    more = f"and {total - len(listed)} more robots: choose some with --model, or write all with --format csv"
    return [f"     {signs}", *lines, *([more] if total > len(listed) else [])]


def _sign(title: str, data: Data) -> str:
    state = _state(title, data)
    return _SIGNS.get(_word(state), state)


def _state(title: str, data: Data) -> str:
    states = data.get("states")
    return shown(states.get(title)) if isinstance(states, dict) else ""


def _signed(title: str, data: Data) -> str:
    state = _state(title, data)
    return f"{_SIGNS.get(_word(state), '')} {state}".strip()


def _pair_text(data: Data) -> str:
    return f"{hex_id(data.get('did'))}:{hex_id(data.get('cid'))}"


def _word(state: str) -> str:
    return state if state in _SIGNS else state.partition(",")[0]


def _decides(state: str | None) -> bool:
    return state is not None and _word(state) in _STRENGTH[:2]


def _strength(state: str | None) -> int:
    """Return how much a state proves: 0 for none."""
    if state is None:
        return 0
    word = _word(state)
    return len(_STRENGTH) + 1 - _STRENGTH.index(word) if word in _STRENGTH else 1
