"""Probes that were in flight when the link dropped: each is sent alone, to know which one drops it."""

from collections import Counter
from collections.abc import AsyncIterator

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.retries import EXECUTED, SUSPECT, SettledProbe, no_result
from sphero_probe.session.reconnect import Reconnector


class DroppedProbes:
    """Sends again what a dropped link left open."""

    def __init__(self, line: Reconnector, prober: Prober) -> None:
        self._line = line
        self._prober = prober
        self._waiting: list[PreparedProbe] = []
        self._drops: Counter[int] = Counter()

    def add(self, probe: PreparedProbe) -> None:
        """Take in a probe that was in flight when the link dropped."""
        self._waiting.append(probe)

    def take(self) -> list[PreparedProbe]:
        """Return what waits to be sent again, and forget it."""
        taken, self._waiting = self._waiting, []
        return taken

    async def ask_again(
        self, error: LinkLostError
    ) -> AsyncIterator[tuple[PreparedProbe, ProbeResult | SettledProbe | None]]:
        """Open the link again and send each probe alone; yield it with its result.

        What may have been executed is not sent again; it comes settled, as does the probe that drops the link
        twice. None stands for a probe that the link was lost over for good.

        Args:
            error: what dropped the link.
        """
        waiting = sorted(self.take(), key=lambda probe: probe.number)
        self._drops.update(probe.number for probe in waiting)
        await self._line.open_again(error)
        for probe in waiting:
            yield probe, await self._ask_alone(probe)

    async def _ask_alone(self, probe: PreparedProbe) -> ProbeResult | SettledProbe | None:
        while not self._line.lost:
            drops = self._drops[probe.number]
            if probe.risk > Risk.WRITE or drops > 1:
                doubt = EXECUTED if probe.risk > Risk.WRITE else SUSPECT
                return SettledProbe(probe, no_result(probe, drops), doubt)
            try:
                return await self._prober.ask(probe, alone=True)
            except LinkLostError as error:
                self._drops[probe.number] += 1
                await self._line.open_again(error)
        return None
