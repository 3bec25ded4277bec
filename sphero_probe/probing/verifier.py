"""The end of a run: send a part of the probes again, one at a time, then wait for late answers."""

import asyncio
from collections.abc import Callable, Iterator, Sequence

from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.probing.pipeline import Pipeline
from sphero_probe.probing.plan import Probe
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.progress import ProgressMeter
from sphero_probe.probing.results import Results
from sphero_probe.probing.retries import SettledProbe
from sphero_probe.probing.verification import contradiction, is_verified


class Verifier:
    """Looks once more at what a run found, and replaces the findings that change."""

    def __init__(
        self,
        prober: Prober,
        pipeline: Pipeline,
        results: Results,
        meter: ProgressMeter,
        is_over: Callable[[], bool],
    ) -> None:
        self._prober, self._pipeline, self._results = prober, pipeline, results
        self._meter, self._is_over = meter, is_over

    async def send_again(self) -> Iterator[Finding]:
        """Send again, one at a time, what exists or was silent, and some of the absent commands.

        Returns:
            The inconclusive findings of probes that ended differently; each replaces its first one as it is
            taken.
        """
        self._pipeline.limit_in_flight(1)
        self._pipeline.on_answer = self._answered
        before = {finding.number: finding for finding in self._results.findings if is_verified(finding)}
        again = (
            self._prober.prepare(self._prober.fill(number, Probe(finding.command, exact=True)))
            for number, finding in sorted(before.items())
        )
        chunk = [prepared for prepared in again if prepared.risk <= Risk.PROBE and not prepared.blocked]
        self._meter.verify(len(chunk), asyncio.get_running_loop().time())
        settled = await self._pipeline.feed(chunk)
        if not self._is_over():
            settled += await self._pipeline.finish()
        return self._contradictions(before, settled)

    async def wait_for_late(self) -> Iterator[Finding]:
        """Wait once for late answers to all silent probes.

        Returns:
            The findings that they change; each replaces its first one as it is taken.
        """
        self._meter.wait()
        return self._answered_late(await self._pipeline.wait_for_late())

    def _answered(self, settled: SettledProbe) -> Finding:
        """Return the finding of an answer; it is recorded only if it differs from the first."""
        self._meter.verified(settled.probe.number)
        return self._results.finding_of(settled)

    def _contradictions(
        self, before: dict[int, Finding], settled: Sequence[SettledProbe]
    ) -> Iterator[Finding]:
        for probe in sorted(settled, key=lambda settled_probe: settled_probe.probe.number):
            self._meter.verified(probe.probe.number)
            old = before[probe.probe.number]
            if changed := contradiction(old, probe.finding or self._results.finding_of(probe)):
                yield self._results.replace(old, changed)

    def _answered_late(self, settled: Sequence[SettledProbe]) -> Iterator[Finding]:
        for probe in settled:
            old = self._results.findings.get(probe.probe.number)
            if old and old.outcome in (Outcome.SILENT, Outcome.INCONCLUSIVE):
                yield self._results.replace(old, self._results.finding_of(probe))
        for old, new in self._results.readings.take(self._results.findings):
            yield self._results.replace(old, new)
