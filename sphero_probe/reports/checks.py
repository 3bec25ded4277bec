"""Looks at this machine and its robot come in as values, their rows and the view that shows them come out."""

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
    """Something can be reached, not everything or not well."""
    FAIL = "fail"
    """What hinders a robot from being reached."""
    SKIPPED = "skipped"
    """Not looked at: it has no ground to stand on, or nothing here tells it."""


class Look(NamedTuple):
    """What a check found.

    Attributes:
        state: how it ended.
        seen: what was seen; may hold strangers' texts.
        fix: what to do, empty where there is nothing to do.
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
    """What was seen, and what to do behind an arrow where there is something to do."""
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
"""What ``doctor`` found, a line each."""
