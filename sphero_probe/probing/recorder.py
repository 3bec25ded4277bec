"""The interface between a run and what records it, and the results of an interrupted run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.finding import Finding, Record


class Recorder(Protocol):
    """Records the intents and results of a run, so that no answer is lost."""

    def intend(self, probe: PreparedProbe) -> None:
        """Record that a probe is about to be sent."""
        ...

    def record(self, record: Record) -> None:
        """Record a heading, finding, note or summary."""
        ...


class NullRecorder:
    """Records nothing."""

    def intend(self, probe: PreparedProbe) -> None:
        """Do nothing."""

    def record(self, record: Record) -> None:
        """Do nothing."""


@dataclass(frozen=True, slots=True)
class PreviousResults:
    """The results of an interrupted run of the same plan on the same robot.

    Attributes:
        findings: number -> finding of a settled probe; it is not sent again.
        doubtful: number -> class of a probe that was sent and never settled. Above ``probe`` it is not sent
            again, because it may have been executed.
        lenient: nodes on which a command accepted a wrong length.
    """

    findings: Mapping[int, Finding] = field(default_factory=dict)
    doubtful: Mapping[int, Risk] = field(default_factory=dict)
    lenient: frozenset[int | None] = frozenset()
