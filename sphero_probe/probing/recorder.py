"""What a run hands to whoever keeps it, and takes back when it goes on: intents and records, findings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.finding import Finding, Record


class Recorder(Protocol):
    """Who keeps what a run intends and finds, so that nothing answered is lost."""

    def intend(self, asked: PreparedProbe) -> None:
        """Take in that a probe is about to be sent."""
        ...

    def record(self, record: Record) -> None:
        """Take in what came to light."""
        ...


class NullRecorder:
    """Keeps nothing."""

    def intend(self, asked: PreparedProbe) -> None:
        """Forget it."""

    def record(self, record: Record) -> None:
        """Forget it."""


@dataclass(frozen=True, slots=True)
class PreviousResults:
    """What an interrupted run of the same plan on the same robot left behind.

    Attributes:
        findings: number -> what was settled; it is not asked again.
        doubtful: number -> class of the probes that went out and were never settled; above ``probe`` they are
            not sent again, for they may have been executed.
        lenient: nodes on which a command accepted a wrong length.
    """

    findings: Mapping[int, Finding] = field(default_factory=dict)
    doubtful: Mapping[int, Risk] = field(default_factory=dict)
    lenient: frozenset[int | None] = frozenset()
