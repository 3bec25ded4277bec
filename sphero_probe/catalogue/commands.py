"""Look-ups in the catalogue: numbers or words come in, rows come out; the unknown gives None or nothing."""

import re
from functools import cache

from sphero_probe.catalogue.model import NO_DEVICE, CommandRow, Kind, Robot
from sphero_probe.errors import nearest
from sphero_probe.protocol.packets import Generation

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
"""Device id -> its name, per generation; of 0x1B and 0x20 no command is known."""

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
    """Give every row of a generation that has a device, by rising device and command id."""
    return _tables()[generation]


def async_rows(generation: Generation) -> tuple[CommandRow, ...]:
    """Give the rows of the asynchronous messages that belong to no device (V1), by rising id.

    Their ``did`` is ``NO_DEVICE``; no look-up by name finds them, as nobody can send them to a robot.
    """
    return _messages()[generation]


def rows_of(generation: Generation, did: int, cid: int) -> tuple[CommandRow, ...]:
    """Give the rows of a pair: none where it is unknown, several where robots mean different things by it."""
    return _by_pair(generation).get((did, cid), ())


def lookup(generation: Generation, did: int, cid: int, robot: Robot | None) -> CommandRow | None:
    """Give the row of a pair as this robot understands it.

    A row that names the robot wins. Where none does and the rows disagree, the most dangerous one is given.
    """
    return _as_understood(rows_of(generation, did, cid), robot)


def notification_row(
    generation: Generation, did: int | None, cid: int, robot: Robot | None
) -> CommandRow | None:
    """Give the row of what a robot says unasked, as this robot means it.

    Args:
        generation: the protocol it was heard in.
        did: device id; None for an asynchronous message of V1.
        cid: command id, or the id of the asynchronous message.
        robot: who said it, None where that is not known.

    Returns:
        The row of a notification; where none has these ids, the row of the command that has them.
    """
    rows = rows_of(generation, NO_DEVICE if did is None else did, cid)
    return _as_understood(tuple(row for row in rows if row.kind is Kind.NOTIFICATION) or rows, robot)


def row_by_name(generation: Generation, name: str) -> CommandRow | None:
    """Find a row by what people type.

    That is a dotted name (``power.sleep``), an alias with its device (``power.enter_soft_sleep``), or either
    without the device, where it means one row only. Case does not matter, nor do ``-`` and ``_`` differ;
    ``getPwrState`` is ``get_pwr_state``.
    """
    names = _by_name(generation)
    found = names.get(_plain(name)) or names.get(_plain(_CAMEL_HUMP.sub("_", name)), ())
    return found[0] if len(found) == 1 else None


def close_names(generation: Generation, text: str) -> list[str]:
    """Give the dotted names that look most like a mistyped one, the nearest first, three at most."""
    known = _by_name(generation)
    near = nearest(_plain(text), known, count=9)
    return list(dict.fromkeys(row.name for word in near for row in known[word]))[:3]


def device_by_name(generation: Generation, text: str) -> int | None:
    """Find the device id that a name means (``power``, ``user-io``); None where none does."""
    word = _plain(text)
    return next((did for did, name in DEVICE_NAMES[generation].items() if name == word), None)


def commands_of(robot: Robot) -> tuple[CommandRow, ...]:
    """Give the rows, notifications included, that name this robot; ``async_rows`` are not among them."""
    return tuple(row for row in all_rows(robot.generation) if robot.key in row.nodes)


def _as_understood(rows: tuple[CommandRow, ...], robot: Robot | None) -> CommandRow | None:
    named = [row for row in rows if robot is not None and robot.key in row.nodes]
    return max(named or rows, key=lambda row: row.risk, default=None)


@cache
def _tables() -> dict[Generation, tuple[CommandRow, ...]]:
    """Load the tables, which are long, when a row is asked for the first time."""
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
    """Map every way to say a name to the rows it means; a more exact way hides the less exact ones."""
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
