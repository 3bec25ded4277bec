"""Find the probe that drops the link: send each probe that was in flight alone, after a reconnect."""

from collections import Counter
from collections.abc import AsyncIterator

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import LinkLostError
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.retries import EXECUTED, SUSPECT, SettledProbe, no_result
from sphero_probe.session.reconnect import Reconnector


class DroppedProbes:
    """Sends probes again that were in flight when the link dropped."""

    def __init__(self, line: Reconnector, prober: Prober) -> None:
        self._line = line
        self._prober = prober
        self._waiting: list[PreparedProbe] = []
        self._drops: Counter[int] = Counter()

    def add(self, probe: PreparedProbe) -> None:
        """Add a probe that was in flight when the link dropped."""
        self._waiting.append(probe)

    def take(self) -> list[PreparedProbe]:
        """Return the probes that wait to be sent again, and forget them."""
        taken, self._waiting = self._waiting, []
        return taken

    async def ask_again(
        self, error: LinkLostError
    ) -> AsyncIterator[tuple[PreparedProbe, ProbeResult | SettledProbe | None]]:
        """Reconnect and send each probe alone; yield it with its result.

        A probe that may have been executed is not sent again and is yielded as settled, as is the probe that
        drops the link twice. The result is None if the link is lost for good.

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
