"""Answers that come after their probe was called silent."""

import asyncio
from collections.abc import Callable
from math import inf
from typing import Final

from sphero_probe.link.exchange import LateResponse
from sphero_probe.probing.retries import SilentProbe

SLOWEST: Final = 5.0
"""Seconds for which an answer to a silent probe is waited for, from its first attempt on."""
_LOOK: Final = 0.25
"""Seconds between two looks at whether the run was ended meanwhile."""


class LateAnswers:
    """Probes that were called silent, and the answers that still came."""

    def __init__(self) -> None:
        self._silent: dict[int, SilentProbe] = {}

    def watch(self, probe: SilentProbe) -> None:
        """Take in a probe that was called silent."""
        self._silent[probe.asked.number] = probe

    def hear(self, late: LateResponse) -> SilentProbe | None:
        """Take in an answer; return the probe that it belongs to, None where it belongs to none of these."""
        return next((probe for probe in self._silent.values() if probe.hear(late)), None)

    async def wait(self, is_over: Callable[[], bool], patience: float) -> list[SilentProbe]:
        """Wait for all of them together; return those that were answered, and forget the others.

        Args:
            is_over: whether the run was ended.
            patience: seconds, from the first attempt of each probe on.
        """
        now = asyncio.get_running_loop().time
        while not is_over():
            open_ = (probe.first_sent for probe in self._silent.values() if not probe.late_answer)
            left = max(open_, default=-inf) + patience - now()
            if left <= 0:
                break
            await asyncio.sleep(min(left, _LOOK))
        answered = [probe for probe in self._silent.values() if probe.late_answer]
        self._silent.clear()
        return answered
