"""Choose the one robot that ``--device`` means from those that were found."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import Final

from sphero_probe.errors import RobotNotFoundError
from sphero_probe.transports.base import HARDWARE_ADDRESS, TRY_FAKE, WHY_UNHEARD, Seen

NAMESAKES: Final = 0.3
"""Seconds after a name was heard in which another robot of that name may still turn up."""
SETTLING: Final = 3.0
"""Seconds after the first robot that may be meant in which all others near are heard, too."""
_LISTED: Final = 8
"""Robots that one message names."""
_LONGEST: Final = 24
"""Characters of a name in a message; Sphero's own have seven."""
_TYPEABLE: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,39}")
"""A name that every shell takes as it stands."""


class Fit(IntEnum):
    """How well a robot fits what was typed, the best first."""

    ADDRESS = 0
    NAME = 1
    NAME_BUT_FOR_CASE = 2
    BEGINNING = 3
    ANY = 4


_PATIENCE: Final = {
    Fit.ADDRESS: 0.0,
    Fit.NAME: NAMESAKES,
    Fit.NAME_BUT_FOR_CASE: NAMESAKES,
    Fit.BEGINNING: SETTLING,
    Fit.ANY: SETTLING,
}


def fit(wanted: str, seen: Seen) -> Fit | None:
    """Return how well a robot fits; None where it is not meant.

    What looks like an address is never compared with names, which anybody can choose. Whole names may be
    anybody's; beginnings, and nothing at all, mean Spheros alone.
    """
    if not wanted:
        return Fit.ANY if seen.is_sphero else None
    folded, name = wanted.casefold(), seen.name.strip()
    if folded == seen.address.casefold():
        return Fit.ADDRESS
    if HARDWARE_ADDRESS.fullmatch(wanted) or not name:
        return None
    if name == wanted:
        return Fit.NAME
    if name.casefold() == folded:
        return Fit.NAME_BUT_FOR_CASE
    return Fit.BEGINNING if seen.is_sphero and name.casefold().startswith(folded) else None


def patience(wanted: str, seen: Seen) -> float | None:
    """Return the seconds to listen on after this robot turned up; None where it is not meant."""
    how = fit(wanted, seen)
    if how is None:
        return None
    return SETTLING if seen.connected else _PATIENCE[how]


def choose(wanted: str, around: Iterable[Seen], seconds: float) -> Seen:
    """Return the one robot that is meant.

    Args:
        wanted: an address, a name or its beginning; empty for the only robot there is.
        around: everyone heard, and those connected to this machine.
        seconds: how long was listened at most.

    Raises:
        RobotNotFoundError: none or more than one is meant, or it is in use.
    """
    everyone = list(around)
    fits = [(how, seen) for seen in everyone if (how := fit(wanted, seen)) is not None]
    best = min((how for how, _ in fits), default=None)
    meant = [seen for how, seen in fits if how is best]
    if not meant:
        raise _unheard(wanted, [seen for seen in everyone if seen.is_sphero], seconds)
    if len(meant) > 1:
        raise _several(wanted, meant)
    (one,) = meant
    if one.connected:
        raise RobotNotFoundError(
            f"{_label(one)} is connected to this machine already",
            "close the program that uses it; was that killed, disconnect the robot in the Bluetooth settings "
            f"(Linux: bluetoothctl disconnect {one.address})",
        )
    return one


def _unheard(wanted: str, robots: Sequence[Seen], seconds: float) -> RobotNotFoundError:
    which = f" '{_short(wanted, 40)}'" if wanted else ""
    others = f"; heard: {_list(robots)}" if robots else ""
    hint = WHY_UNHEARD if wanted else f"{WHY_UNHEARD} {TRY_FAKE}"
    return RobotNotFoundError(f"no robot{which} was heard within {seconds:g} s{others}", hint)


def _several(wanted: str, meant: Sequence[Seen]) -> RobotNotFoundError:
    names = {seen.name for seen in meant}
    if wanted and len(names) == 1:
        addresses = _enumerate([seen.address for seen in meant])
        return RobotNotFoundError(
            f"{len(meant)} robots are called {_short(meant[0].name)}: {addresses}",
            f"type the address: --device {meant[0].address}",
        )
    said = f"'{_short(wanted, 40)}' fits {len(meant)} robots" if wanted else f"{len(meant)} robots are near"
    return RobotNotFoundError(f"{said}: {_list(meant)}", f"choose one: --device {_word(meant)}")


def _word(robots: Sequence[Seen]) -> str:
    """Return what to type for the first robot that is free: its name where that is safe and its own."""
    one = next((seen for seen in robots if not seen.connected), robots[0])
    shared = sum(seen.name.casefold() == one.name.casefold() for seen in robots) > 1
    typeable = _TYPEABLE.fullmatch(one.name) and not HARDWARE_ADDRESS.fullmatch(one.name)
    return one.name if typeable and not shared else one.address


def _list(robots: Sequence[Seen]) -> str:
    """Names, an address beside each that is not alone in its name."""
    named = Counter(seen.name for seen in robots)
    return _enumerate(
        [
            _label(seen)
            + (f" ({seen.address})" if seen.name and named[seen.name] > 1 else "")
            + (" (connected to this machine)" if seen.connected else "")
            for seen in robots
        ]
    )


def _enumerate(items: Sequence[str]) -> str:
    more = f" and {len(items) - _LISTED} more" if len(items) > _LISTED else ""
    return ", ".join(items[:_LISTED]) + more


def _label(seen: Seen) -> str:
    return _short(seen.name) or seen.address


def _short(text: str, longest: int = _LONGEST) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"
