"""Lengths that make a probe harmless, and commands that cannot exist."""

from typing import Final

from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Command

WRONG_LENGTH: Final = 11
"""Length of a probe's payload: no documented command takes it, and it fills one 20-byte BLE write."""
WRONG_PAYLOAD: Final = bytes(WRONG_LENGTH)
"""The payload of nearly every probe of a sweep."""
WRONG_LENGTHS: Final = frozenset({11, 13, 40})
"""Lengths that no documented fixed-length command takes [commands_v2]."""
IMPOSSIBLE_DIDS: Final = (0xEE, 0xED, 0xEC)
"""Device ids far from any that a robot is known to have."""
IMPOSSIBLE_CIDS: Final = (0xFD, 0xFC, 0xFB)
"""Command ids far from any that a device is known to have."""


def is_wrong_length(command: Command, row: CommandRow | None) -> bool:
    """Whether a command is harmless only if its node rejects wrong lengths without executing.

    Args:
        command: with its payload.
        row: the catalogue's row of the command, None if there is none.
    """
    length = len(command.payload)
    if row is None or row.kind is Kind.NOTIFICATION:
        return length in WRONG_LENGTHS and not any(command.payload)
    rejectable = row.request is not None and not row.request.accepts(length)
    return rejectable and row.risk is Risk.WRITE


def is_impossible(command: Command) -> bool:
    """Whether this is a probe of a command that cannot exist, sent to see how the robot answers it."""
    did, cid, payload, _, _ = command
    if not ((did in IMPOSSIBLE_DIDS and cid == 0) or cid in IMPOSSIBLE_CIDS):
        return False
    return (not payload or len(payload) in WRONG_LENGTHS) and not any(payload)
