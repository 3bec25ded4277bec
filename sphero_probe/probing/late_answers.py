"""Wait for answers that arrive after their probe counted as silent."""

import asyncio
from collections.abc import Callable
from math import inf
from typing import Final

from sphero_probe.link.exchange import LateResponse
from sphero_probe.probing.retries import SilentProbe

SLOWEST: Final = 5.0
"""Seconds to wait for an answer to a silent probe, from its first attempt on."""
LOOK: Final = 0.25
"""Seconds between two checks whether the run was ended meanwhile."""


class LateAnswers:
    """Silent probes, and the answers that still arrive."""

    def __init__(self) -> None:
        self._silent: dict[int, SilentProbe] = {}

    def watch(self, silent: SilentProbe) -> None:
        """Add a silent probe."""
        self._silent[silent.probe.number] = silent

    def hear(self, late: LateResponse) -> SilentProbe | None:
        """Match an answer; return the probe that it belongs to, None if it belongs to none of these."""
        return next((silent for silent in self._silent.values() if silent.hear(late)), None)

    @property
    def last_sent(self) -> float:
        """When the last of the probes that are still silent was first sent; -inf if there is none."""
        sent = (silent.first_sent for silent in self._silent.values() if not silent.late_answer)
        return max(sent, default=-inf)

    async def wait(self, is_over: Callable[[], bool], seconds: float) -> list[SilentProbe]:
        """Wait for all silent probes at once; return those that were answered, and forget the others.

        Args:
            is_over: whether the run was ended.
            seconds: to wait, from the first attempt of each probe on.
        """
        now = asyncio.get_running_loop().time
        while not is_over():
            remaining = self.last_sent + seconds - now()
            if remaining <= 0:
                break
            await asyncio.sleep(min(remaining, LOOK))
        answered = [silent for silent in self._silent.values() if silent.late_answer]
        self._silent.clear()
        return answered
