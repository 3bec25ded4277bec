"""Choose the documented commands that may get a wrong length, to see whether it is rejected."""

from collections.abc import Collection
from functools import lru_cache
from typing import Final

from sphero_probe.catalogue import all_rows, commands_of
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.wrong_lengths import WRONG_LENGTH
from sphero_probe.protocol.packets import Generation

_READS_TRIED: Final = 8
"""The most reads that are tried on a node."""
SETTERS: Final = 2
"""The most harmless setters of a device that get a wrong length."""
_HARMLESS: Final = ("enable_", "_notify")
"""Parts of the names of setters that change nothing when all their arguments are zero."""


def calibration_rows(
    generation: Generation, robot: Robot | None, did: int
) -> tuple[list[CommandRow], list[CommandRow]]:
    """Return the documented reads and harmless setters of a device for which there is a wrong length.

    Args:
        generation: the protocol of the catalogue.
        robot: the model, None if it is not known: then all rows of the device are used.
        did: the device id.
    """
    rows = _with_wrong_length(generation, robot.key if robot else "", did)
    reads = [row for row in rows if row.risk is Risk.READ]
    setters = [row for row in rows if row.risk is Risk.WRITE and _changes_nothing(row)]
    return reads, setters[:SETTERS]


def reads_to_try(generation: Generation, robot: Robot | None, dids: Collection[int]) -> list[CommandRow]:
    """Return the documented reads without arguments to try on a node, in order.

    Those of the devices to be probed come first, and of these the reads whose answer has a fixed length.

    Args:
        generation: the protocol of the catalogue.
        robot: the model, None if it is not known: then all rows are used.
        dids: the devices to be probed.
    """

    def order(row: CommandRow) -> tuple[bool, bool]:
        return row.did not in dids, not row.response or not row.response.fixed_length

    return [
        row
        for row in sorted(commands_of(robot) if robot else all_rows(generation), key=order)
        if row.kind is Kind.COMMAND and row.risk is Risk.READ and row.request and not row.request.text
    ][:_READS_TRIED]


def has_setters(generation: Generation, robot: Robot | None, did: int) -> bool:
    """Whether a documented setter of this device may get a wrong length; the arguments are as above."""
    rows = _with_wrong_length(generation, robot.key if robot else "", did)
    return any(row.risk is Risk.WRITE for row in rows)


@lru_cache(maxsize=1024)
def _with_wrong_length(generation: Generation, robot: str, did: int) -> tuple[CommandRow, ...]:
    """Return the rows of a device that do not take the length of a probe; of all robots if none is named."""
    return tuple(
        row
        for row in all_rows(generation)
        if row.did == did
        and row.kind is Kind.COMMAND
        and row.request is not None
        and not row.request.accepts(WRONG_LENGTH)
        and (not robot or robot in row.nodes)
    )


def _changes_nothing(row: CommandRow) -> bool:
    name = row.name.partition(".")[2]
    return any(part in name for part in _HARMLESS)
