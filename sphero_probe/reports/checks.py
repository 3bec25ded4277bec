"""The results of ``doctor``: their type, their rows, and the view that shows them."""

from collections.abc import Callable
from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.reports.phrases import Data, shown
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import Column, Place, View


class State(StrEnum):
    """How a check ended."""

    OK = "ok"
    WARN = "warn"
    """It works, but not fully or not well."""
    FAIL = "fail"
    """No robot can be reached because of this."""
    SKIPPED = "skipped"
    """Not checked: an earlier check failed, or it cannot be found out here."""


class Look(NamedTuple):
    """What a check found.

    Attributes:
        state: how it ended.
        seen: what was seen; may hold text from robots.
        fix: what to do, empty for nothing.
    """

    state: State
    seen: str
    fix: str = ""


Tell = Callable[[str, Look], None]
"""Takes the name of a check and what it found."""


def check_row(name: str, look: Look) -> Row:
    """Return the row of a check: ``state`` is ``ok``, ``warn``, ``fail`` or ``skipped``."""
    return Row("check", {"name": name, "state": look.state.value, "seen": look.seen, "fix": look.fix})


def _told(data: Data) -> str:
    """Return what was seen, and what to do after an arrow."""
    return " -> ".join(filter(None, (shown(data.get("seen")), shown(data.get("fix")))))


CHECKS: Final = View(
    "check",
    (
        Column("", "State", lambda data: shown(data.get("state")), Place.TABLE, whole=True),
        Column("name", "What", lambda data: shown(data.get("name")), whole=True),
        Column("state", "State", lambda data: shown(data.get("state")), Place.RECORD),
        Column("seen", "Seen", lambda data: shown(data.get("seen")), Place.RECORD),
        Column("fix", "What to do", lambda data: shown(data.get("fix")), Place.RECORD),
        Column("", "Seen -> what to do", _told, Place.TABLE),
    ),
    "Nothing was checked.",
)
"""The results of ``doctor``, one per line."""
