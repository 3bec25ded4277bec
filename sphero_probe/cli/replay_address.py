"""The run that a ``replay:`` address names, by its path."""

import os
from typing import Final

from sphero_probe.errors import SpheroProbeError
from sphero_probe.runs.store import find_journal

RECORDED: Final = "replay:"


def with_path(address: str) -> str:
    """Return a device address with the path of the run that it names: ``replay:last``, ``replay:NAME``.

    Any other address is returned unchanged, also one that names no run: opening it gives the error.
    """
    name, mark, query = address.removeprefix(RECORDED).partition("?")
    if not address.startswith(RECORDED) or not name or os.path.lexists(name):
        return address
    try:
        return f"{RECORDED}{find_journal(name)}{mark}{query}"
    except SpheroProbeError:
        return address
