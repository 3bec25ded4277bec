"""Count how far a run is, and estimate how long it will still take, from what was measured in it."""

from collections.abc import Collection, Container, Sequence
from itertools import groupby
from typing import Final, NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.verification import ABSENT_SHARE, is_verified

CALIBRATING: Final = "calibrating"
VERIFYING: Final = "verifying"
WAITING: Final = "waiting for late answers"
_SAMPLED: Final = 8
"""One in so many probes of a stage is assessed beforehand, to estimate how many will be sent."""
_TIMED: Final = 24
"""Probes after which the rate of a stage, or of the run, counts."""


class Progress(NamedTuple):
    """How far a run is.

    Attributes:
        stage: what is being done, in a few words: ``devices``, ``calibrating``, ``verifying``.
        number: of the stage, from 1; consecutive stages of one name count as one.
        stages: how many there are, verifying included.
        done: probes that are settled or verified.
        total: probes that will be, as far as is known; until verifying begins, its share is an estimate.
        is_total_known: False while probes of a later stage follow from what is still to be found.
        exist: commands that exist, so far.
        new: those of them that no catalogue has.
        seconds_left: an estimate; at least so many while the total is not known. None until it was measured.
    """

    stage: str
    number: int
    stages: int
    done: int
    total: int
    is_total_known: bool = True
    exist: int = 0
    new: int = 0
    seconds_left: float | None = None


class _Rate:
    """The time that one probe takes: in this stage, once enough were sent, else in all stages so far."""

    def __init__(self) -> None:
        self._sent = self._sent_before = 0
        self._seconds_before = 0.0
        self._began: float | None = None

    def begin(self, now: float) -> None:
        self.pause(now)
        self._began = now

    def pause(self, now: float) -> None:
        self._seconds_before += self._seconds(now)
        self._sent_before += self._sent
        self._sent, self._began = 0, None

    def count(self) -> None:
        self._sent += 1

    def seconds_per_probe(self, now: float) -> float | None:
        if self._sent >= _TIMED:
            return self._seconds(now) / self._sent
        sent = self._sent_before + self._sent
        return (self._seconds_before + self._seconds(now)) / sent if sent >= _TIMED else None

    def _seconds(self, now: float) -> float:
        return 0.0 if self._began is None else now - self._began


class ProgressMeter:
    """Learns of each step of a run as it happens, and tells how far the run is."""

    def __init__(self, plan: Plan, prober: Prober, settled: Container[int]) -> None:
        """Prepare to count.

        Args:
            plan: what will be sent.
            prober: knows which probes are blocked, and how long a round trip takes.
            settled: numbers of the probes that an interrupted run settled: they take no time.
        """
        self._plan, self._prober, self._settled = plan, prober, settled
        self._round_trip: float | None = None
        self._names = [plan.stage_name(index) for index in range(len(plan.stages))]
        groups = [len(list(group)) for _, group in groupby(self._names)]
        self._numbers = [number for number, size in enumerate(groups, 1) for _ in range(size)]
        self._last = len(groups) + plan.verify
        self._doing, self._number = CALIBRATING, 1
        self._rate = _Rate()
        self._is_sent: list[bool] = []
        self._later = list(plan.stages)
        self._probes = self._done = self._done_before = 0
        self._exist = self._new = self._to_verify = self._to_verify_before = 0
        self._verifying: int | None = None
        self._verified: set[int] = set()

    def calibrate(self, index: int, now: float) -> None:
        """Record that a stage begins with calibrating its nodes and devices."""
        self._doing, self._number = CALIBRATING, self._numbers[index]
        self._rate.pause(now)

    def begin(self, index: int, first: int, probes: Sequence[Probe], now: float) -> None:
        """Record that the probes of a stage are sent from now on.

        Args:
            index: of the stage, from 0.
            first: number of its first probe.
            probes: of the stage.
            now: the time.
        """
        if self._round_trip is None:  # of calibration, which has little else in flight, as verifying has
            self._round_trip = self._prober.link.pace(self._prober.target).round_trip
        self._doing, self._number = self._names[index], self._numbers[index]
        self._later = list(self._plan.stages[index + 1 :])
        self._probes += len(probes)
        self._done_before, self._to_verify_before = self._done, self._to_verify
        self._is_sent = [
            first + offset not in self._settled and not self._prober.is_blocked(probes[offset])
            for offset in range(0, len(probes), _SAMPLED)
        ]
        self._rate.begin(now)

    def add(self, finding: Finding) -> None:
        """Count a finding of a probe that had none."""
        self._done += 1
        if finding.attempts and finding.number not in self._settled:
            self._rate.count()
        self._to_verify += finding.risk <= Risk.PROBE and is_verified(finding)
        if finding.outcome is Outcome.EXISTS:
            self._exist += 1
            self._new += finding.knowledge is None

    def verify(self, count: int, now: float) -> None:
        """Record that so many probes are sent again from now on, one at a time."""
        self._doing, self._number = VERIFYING, self._last
        self._verifying, self._is_sent = count, []
        self._rate = _Rate()
        self._rate.begin(now)

    def verified(self, number: int) -> None:
        """Record that a probe was answered again, or ended otherwise."""
        if number not in self._verified:
            self._verified.add(number)
            self._rate.count()

    def wait(self) -> None:
        """Record that only late answers are waited for."""
        self._doing, self._number = WAITING, self._last
        self._verifying = None if self._verifying is None else len(self._verified)

    def progress(self, now: float, late_until: float | None) -> Progress:
        """Return how far the run is, and estimate the rest.

        Args:
            now: the time.
            late_until: when waiting for late answers ends, None if no probe is silent.
        """
        later = sum(len(stage) for stage in self._later if isinstance(stage, Collection))
        to_send = self._to_send() + later
        to_verify = self._left_to_verify(to_send)
        late = 0.0 if late_until is None else max(0.0, late_until - now)
        left = self._seconds(to_send, to_verify, now)
        return Progress(
            self._doing,
            self._number,
            self._last,
            self._done + len(self._verified),
            self._probes + later + len(self._verified) + to_verify,
            all(isinstance(stage, Collection) for stage in self._later),
            self._exist,
            self._new,
            None if left is None else max(left, late),
        )

    def _to_send(self) -> int:
        """Return how many probes of this stage are still to be sent."""
        place = self._done - self._done_before
        sent = sum(self._is_sent[place // _SAMPLED :]) * _SAMPLED
        return min(sent, self._probes - self._done)

    def _left_to_verify(self, to_send: int) -> int:
        """Return how many probes are still to be verified, as far as can be told."""
        if self._verifying is not None:
            return self._verifying - len(self._verified)
        if not self._plan.verify:
            return 0
        share, done = 1 / ABSENT_SHARE, self._done - self._done_before
        if done >= _TIMED:
            share = max(share, (self._to_verify - self._to_verify_before) / done)
        return self._to_verify + round(to_send * share)

    def _seconds(self, to_send: int, to_verify: int, now: float) -> float | None:
        """Return how long sending the rest takes, None if nothing was measured yet."""
        per_probe = self._rate.seconds_per_probe(now)
        if self._verifying is not None:
            return to_verify * (per_probe or self._round_trip or 0.0)
        if per_probe is None and to_send:
            return None
        return to_send * (per_probe or 0.0) + to_verify * (self._round_trip or 0.0)
