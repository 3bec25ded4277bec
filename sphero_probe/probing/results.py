"""The findings of one run: judged and recorded, and replaced where something later tells more."""

import asyncio

from sphero_probe.probing.executions import Executions
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.probing.judge import finding_of
from sphero_probe.probing.kept_findings import KeptFindings
from sphero_probe.probing.notes import node_name
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.readings import Readings
from sphero_probe.probing.recorder import Recorder
from sphero_probe.probing.retries import SettledProbe
from sphero_probe.probing.unreachable import is_unreachable


class Results:
    """Judges the settled probes of one run.

    Attributes:
        findings: that something may still read.
        firmware: node name -> version, for what the catalogue knows about it.
        readings: which notifications may answer which readings.
        is_incomplete: whether a node could not be asked.
    """

    def __init__(
        self, prober: Prober, recorder: Recorder, executions: Executions, findings: KeptFindings
    ) -> None:
        self.findings = findings
        self.firmware: dict[str, str] = {}
        self.readings = Readings()
        self.is_incomplete = False
        self._prober = prober
        self._recorder = recorder
        self._executions = executions

    def judge(self, settled: SettledProbe) -> Finding:
        """Judge a settled probe and record the finding."""
        finding = self.finding_of(settled)
        self.readings.look(finding, now=asyncio.get_running_loop().time())
        self._recorder.record(finding)
        return finding

    def finding_of(self, settled: SettledProbe) -> Finding:
        """Return the finding of a settled probe; any doubt makes it inconclusive."""
        probe, result, doubt, _ = settled
        command, robot = probe.command, self._prober.link.policy.robot
        finding = finding_of(
            probe,
            result,
            self._prober.link.codec,
            masked=self._prober.masks(command.target),
            device=self._prober.devices.get((command.target, command.did)),
            robot=robot,
            firmware=self.firmware.get(node_name(command.target, robot), ""),
        )
        if probe.number in self._executions.numbers:
            finding = finding._replace(note="executed: it accepted this length")
        self.is_incomplete |= is_unreachable(finding, self._prober.link.codec, robot)
        return finding._replace(outcome=Outcome.INCONCLUSIVE, note=doubt) if doubt else finding

    def replace(self, old: Finding, new: Finding) -> Finding:
        """Let a finding take the place of an earlier one of the same probe; record and return it."""
        self.findings.replace(old, new)
        self._recorder.record(new)
        return new
