"""Finds rows of the catalogue by id or by name; an unknown id or name gives None or nothing."""

import re
from functools import cache

from sphero_probe.catalogue.model import NO_DEVICE, CommandRow, Kind, Robot
from sphero_probe.errors import nearest
from sphero_probe.protocol.packets import Generation

_SEPARATORS = re.compile(r"[._ ]")
_PLACEHOLDER = "unknown_0x"
"""In the name of a command of which only the id is known."""
_MISSPELT = 0.8
"""From which similarity on a word is another one, misspelt."""

DEVICE_NAMES: dict[Generation, dict[int, str]] = {
    Generation.V1: {0x00: "core", 0x01: "bootloader", 0x02: "sphero"},
    Generation.V2: {
        0x10: "api_and_shell",
        0x11: "system_info",
        0x12: "system_mode",
        0x13: "power",
        0x16: "drive",
        0x17: "animatronic",
        0x18: "sensor",
        0x19: "connection",
        0x1A: "user_io",
        0x1B: "storage",
        0x1D: "firmware",
        0x1E: "wifi",
        0x1F: "factory_test",
        0x20: "macro_system",
        0xFE: "proto",
    },
}
"""Device id -> name, per generation; no command of 0x1B and 0x20 is known."""

BRICK_DEVICES: dict[Generation, frozenset[int]] = {
    Generation.V1: frozenset({0x01}),
    Generation.V2: frozenset({0x1B, 0x1D, 0x1E, 0x1F, 0xFE}),
}
"""Devices whose unknown commands count as brick, per generation."""
PERSIST_DEVICES: dict[Generation, frozenset[int]] = {
    Generation.V1: frozenset(),
    Generation.V2: frozenset({0x20}),
}
"""Devices whose unknown commands count as persist, per generation."""
MOVING_DEVICES: dict[Generation, frozenset[int]] = {
    Generation.V1: frozenset({0x02}),
    Generation.V2: frozenset({0x16, 0x17}),
}
"""Devices whose commands drive motors, per generation."""
NO_EMPTY_PROBE_DEVICES: dict[Generation, frozenset[int]] = {
    Generation.V1: frozenset(),
    Generation.V2: frozenset({0x11, 0x1A}),
}
"""Devices whose unknown commands are never asked with an empty payload, per generation."""

_CAMEL_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


def all_rows(generation: Generation) -> tuple[CommandRow, ...]:
    """Return every row of a generation that has a device, sorted by device id and command id."""
    return _tables()[generation]


def async_rows(generation: Generation) -> tuple[CommandRow, ...]:
    """Return the rows of the asynchronous messages that belong to no device (V1), sorted by id.

    Their ``did`` is ``NO_DEVICE``. No look-up by name finds them, because they cannot be sent to a robot.
    """
    return _messages()[generation]


def rows_of(generation: Generation, did: int, cid: int) -> tuple[CommandRow, ...]:
    """Return the rows of a pair: none if it is unknown, several if its meaning differs between robots."""
    return _by_pair(generation).get((did, cid), ())


def lookup(generation: Generation, did: int, cid: int, robot: Robot | None) -> CommandRow | None:
    """Return the row of a pair for this robot.

    A row that names the robot is preferred. If none does, the row with the highest risk is returned.
    """
    rows = rows_of(generation, did, cid)
    return _as_understood(rows, robot) if rows else None  # most pairs have none: a sweep asks for all


def notification_row(
    generation: Generation, did: int | None, cid: int, robot: Robot | None
) -> CommandRow | None:
    """Return the row of a notification from this robot.

    Args:
        generation: the protocol it was received in.
        did: device id; None for an asynchronous message of V1.
        cid: command id, or the id of the asynchronous message.
        robot: the model that sent it, None where it is not known.

    Returns:
        The row of a notification; where none has these ids, the row of the command that has them.
    """
    rows = rows_of(generation, NO_DEVICE if did is None else did, cid)
    return _as_understood(tuple(row for row in rows if row.kind is Kind.NOTIFICATION) or rows, robot)


def row_by_name(generation: Generation, name: str) -> CommandRow | None:
    """Find a row by a name that a person typed.

    Accepted are a dotted name (``power.sleep``), an alias with its device (``power.enter_soft_sleep``), and
    either without the device if that is unambiguous. Case does not matter, ``-`` and ``_`` are the same, and
    ``getPwrState`` is ``get_pwr_state``.
    """
    names = _by_name(generation)
    found = names.get(_plain(name)) or names.get(_plain(_CAMEL_HUMP.sub("_", name)), ())
    return found[0] if len(found) == 1 else None


def close_names(generation: Generation, text: str) -> list[str]:
    """Return up to three dotted names that are most similar to a mistyped one, the nearest first.

    A name is also similar if its words are: ``batery`` is one of ``power.get_battery_percentage``.
    """
    known = {name: rows for name, rows in _by_name(generation).items() if _PLACEHOLDER not in rows[0].name}
    typed = _plain(text)
    by_word: dict[str, set[str]] = {}
    for name in known:
        for word in _words(name):
            by_word.setdefault(word, set()).add(name)
    alike = [
        set().union(*(by_word[word] for word in nearest(one, by_word, count=3, similarity=_MISSPELT)))
        for one in _words(typed)
    ]
    shared = sorted(set.intersection(*alike) if alike else (), key=_short_reads_first)
    near = [*nearest(typed, known, count=9, similarity=_MISSPELT), *shared, *nearest(typed, known, count=9)]
    return list(dict.fromkeys(row.name for word in near for row in known[word]))[:3]


def _short_reads_first(name: str) -> tuple[int, bool, str]:
    words = _words(name)
    return len(words), "get" not in words, name


def _words(name: str) -> list[str]:
    return [word for word in _SEPARATORS.split(name) if word]


def device_by_name(generation: Generation, text: str) -> int | None:
    """Return the device id of a name (``power``, ``user-io``), or None."""
    word = _plain(text)
    return next((did for did, name in DEVICE_NAMES[generation].items() if name == word), None)


def commands_of(robot: Robot) -> tuple[CommandRow, ...]:
    """Return the rows that name this robot, with notifications but without ``async_rows``."""
    return tuple(row for row in all_rows(robot.generation) if robot.key in row.nodes)


def devices_of(robot: Robot | None, node: int) -> tuple[int, ...]:
    """Return the device ids that a robot's node is known to serve, in rising order; none where unknown."""
    if robot is None:
        return ()
    rows = (row for row in commands_of(robot) if row.kind is Kind.COMMAND)
    return tuple(sorted({row.did for row in rows if node in row.nodes.get(robot.key, ())}))


def _as_understood(rows: tuple[CommandRow, ...], robot: Robot | None) -> CommandRow | None:
    named = [row for row in rows if robot is not None and robot.key in row.nodes]
    return max(named or rows, key=lambda row: row.risk, default=None)


@cache
def _tables() -> dict[Generation, tuple[CommandRow, ...]]:
    """Load the tables, which are long, on first use."""
    from sphero_probe.catalogue.tables import (  # noqa: PLC0415
        v1,
        v2_firmware,
        v2_motion,
        v2_output,
        v2_system,
    )

    second = v2_system.ROWS + v2_motion.ROWS + v2_output.ROWS + v2_firmware.ROWS
    return {
        generation: tuple(sorted(rows, key=lambda row: (row.did, row.cid)))
        for generation, rows in ((Generation.V1, v1.ROWS), (Generation.V2, second))
    }


@cache
def _messages() -> dict[Generation, tuple[CommandRow, ...]]:
    from sphero_probe.catalogue.tables import v1  # noqa: PLC0415

    return {Generation.V1: v1.ASYNC_ROWS, Generation.V2: ()}


def _plain(text: str) -> str:
    return re.sub(r"[-\s]+", "_", text.strip().lower())


@cache
def _by_pair(generation: Generation) -> dict[tuple[int, int], tuple[CommandRow, ...]]:
    pairs: dict[tuple[int, int], tuple[CommandRow, ...]] = {}
    for row in all_rows(generation) + async_rows(generation):
        pairs[row.did, row.cid] = (*pairs.get((row.did, row.cid), ()), row)
    return pairs


@cache
def _by_name(generation: Generation) -> dict[str, tuple[CommandRow, ...]]:
    """Map every accepted form of a name to its rows; a more exact form hides the less exact ones."""
    names: dict[str, tuple[CommandRow, ...]] = {}
    devices = DEVICE_NAMES[generation]
    rows = all_rows(generation)
    for ways in (
        [(row.name, row) for row in rows],
        [(f"{devices[row.did]}.{alias}", row) for row in rows for alias in row.aliases],
        [(row.name.partition(".")[2], row) for row in rows],
        [(alias, row) for row in rows for alias in row.aliases],
    ):
        fresh: dict[str, tuple[CommandRow, ...]] = {}
        for word, row in ways:
            fresh[word] = (*fresh.get(word, ()), row)
        names = fresh | names
    return names
