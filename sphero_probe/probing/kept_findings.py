"""The findings of one run, as far as a later step may still read them.

Nearly all findings of a sweep are recorded, yielded and never read again. They are counted and forgotten, so
that the memory of a run does not grow with its probes.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

from sphero_probe.probing.comparison import AbsentCommands
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.readings import EXPECTED
from sphero_probe.probing.verification import is_verified
from sphero_probe.protocol.codec import Codec

_FINAL: Final = (Outcome.EXISTS, Outcome.ABSENT, Outcome.SKIPPED)
"""Outcomes that no late answer changes."""


class KeptFindings:
    """Counts the findings of one run, and keeps those that a later step may still read or replace.

    All are kept while a later stage is made from them, and in a plan that compares all of them at its end.
    Otherwise those are kept that a late answer or a notification may change, and in a run that verifies its
    findings those that are sent again.

    Attributes:
        counts: outcome -> number of findings.
        sent: how many findings are of probes that were sent.
    """

    def __init__(self, plan: Plan, codec: Codec) -> None:
        """Prepare for a run.

        Args:
            plan: what is run.
            codec: whose codes the answers carry.
        """
        self.counts: Counter[Outcome] = Counter()
        self.sent = 0
        self._plan, self._codec = plan, codec
        self._forgets = False
        self._by_number: dict[int, Finding] = {}
        self._forgotten = AbsentCommands(codec)

    def __iter__(self) -> Iterator[Finding]:
        """Iterate over those that are kept, in the order in which they were settled."""
        return iter(self._by_number.values())

    def get(self, number: int) -> Finding | None:
        """Return the finding of this number, None if there is none or it is not kept."""
        return self._by_number.get(number)

    def for_stage(self, index: int) -> Sequence[Finding]:
        """Return what a stage is made from: all findings so far by number; nothing if it is not a function.

        Args:
            index: of the stage, from 0.
        """
        if not callable(self._plan.stages[index]):
            return ()
        return sorted(self, key=lambda finding: finding.number)

    def begin(self, index: int) -> None:
        """Record that the probes of a stage are made: findings that no later stage is made from may go.

        Args:
            index: of the stage, from 0.
        """
        if self._plan.claimed_by or any(map(callable, self._plan.stages[index + 1 :])):
            return
        self._forgets = True
        held, self._by_number = self._by_number, {}
        for finding in held.values():
            self._keep(finding)

    def add(self, finding: Finding) -> None:
        """Count the finding of a probe that had none, and keep it if need be."""
        self._count(finding, 1)
        self._keep(finding)

    def replace(self, old: Finding, new: Finding) -> None:
        """Let a finding take the place of an earlier one of the same probe, which is kept."""
        self._count(old, -1)
        self._count(new, 1)
        self._by_number[new.number] = new

    def absent(self) -> AbsentCommands:
        """Return the absent commands and devices of a run that verifies its findings, once it has ended."""
        for finding in self:
            self._forgotten.learn(finding)
        return self._forgotten

    def _count(self, finding: Finding, change: int) -> None:
        self.counts[finding.outcome] += change
        self.sent += change if finding.attempts else 0

    def _keep(self, finding: Finding) -> None:
        if not self._forgets or self._may_be_read(finding):
            self._by_number[finding.number] = finding
        elif self._plan.verify:
            self._forgotten.learn(finding)

    def _may_be_read(self, finding: Finding) -> bool:
        return (
            finding.outcome not in _FINAL
            or finding.note == EXPECTED
            or (self._plan.verify and is_verified(finding))
        )
