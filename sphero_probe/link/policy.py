"""Decide which commands may be sent to a robot.

Every command passes ``Policy.assess`` before it is sent. Its risk class follows from the catalogue and from
what calibration measured; where neither says enough, the more dangerous class counts.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Final, NamedTuple, Self

from sphero_probe.catalogue import (
    BRICK_DEVICES,
    NO_EMPTY_PROBE_DEVICES,
    PERSIST_DEVICES,
    all_rows,
    rows_of,
)
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.length_checks import LengthChecks
from sphero_probe.link.wrong_lengths import is_impossible, is_wrong_length
from sphero_probe.protocol.packets import Command, Generation

NEIGHBOURHOOD: Final = 2
"""An unknown command with an id this close to a variable-length persist or brick command gets its class."""
_KEPT: Final = 1024
"""Assessments that a policy caches."""


class Assessment(NamedTuple):
    """What sending a command may do, and whether it may be sent.

    Attributes:
        risk: the class.
        reason: why it has that class, a phrase.
        blocked: why the policy blocks it and which flag allows it; empty when it may be sent.
    """

    risk: Risk
    reason: str
    blocked: str = ""


class Consent(NamedTuple):
    """What the user has allowed.

    Attributes:
        allowed: risk classes; allowing one allows no other.
        confirmed: the robot's name, typed in full; needed for ``brick``.
    """

    allowed: frozenset[Risk] = frozenset({Risk.READ, Risk.PROBE})
    confirmed: str = ""

    @classmethod
    def of(cls, allow: Iterable[str] = (), confirm: str = "", *also: Risk) -> Self:
        """Return the default consent and more.

        Args:
            allow: risk classes by name, as ``--allow`` takes them.
            confirm: the robot's name, as ``--confirm`` takes it.
            also: further classes.
        """
        return cls(cls().allowed | {Risk[word.upper()] for word in allow} | set(also), confirm)

    @property
    def words(self) -> tuple[str, ...]:
        """The allowed classes by name, mildest first."""
        return tuple(risk.word for risk in sorted(self.allowed))


def flag_for(risk: Risk) -> str:
    """Return the options that allow a class."""
    return f"--allow {risk.word}" + " --confirm NAME-OF-ROBOT" * (risk is Risk.BRICK)


def why_blocked(assessment: Assessment, consent: Consent, robot_names: Iterable[str]) -> str | None:
    """Return why a command of this class is blocked and which flag allows it, None when it may be sent.

    Args:
        assessment: what the command may do.
        consent: what was allowed.
        robot_names: the names that ``--confirm`` may repeat.
    """
    risk, reason, _ = assessment
    if risk not in consent.allowed:
        return f"{risk.word}: {reason} ({flag_for(risk)})"
    if risk is Risk.BRICK and not _confirms(consent, robot_names):
        return f"brick: {reason} (--confirm needs this robot's name)"
    return None


def _confirms(consent: Consent, robot_names: Iterable[str]) -> bool:
    return bool(consent.confirmed) and consent.confirmed in set(robot_names)


class Policy:
    """What one link may send, by consent, the robot's catalogue, and what was measured on the robot.

    Attributes:
        consent: what the user has allowed.
        generation: the robot's protocol.
        robot: the model, None if it is not known.
        length_checks: what was measured about length checks.
    """

    def __init__(
        self,
        generation: Generation,
        robot: Robot | None,
        consent: Consent,
        names: Iterable[str] = (),
    ) -> None:
        self.consent = consent
        self.robot = robot
        self.length_checks = LengthChecks()
        self.generation = generation
        self._names = tuple(names)
        self._assessed: dict[Command, Assessment] = {}
        self._revision = 0
        self._implied: Counter[tuple[Command, Risk]] = Counter()
        self._implications = 0

    @property
    def revision(self) -> int:
        """Changes whenever a measurement, or ``implying``, changes what may be sent."""
        return self.length_checks.revision + self._implications

    @contextmanager
    def implying(self, risk: Risk, *commands: Command) -> Iterator[None]:
        """Allow a class for exactly these commands while the block lasts, whatever the consent.

        For example, a user who asks for a LED colour also allows the command that sets it. Blocks may be
        nested and may overlap.

        Args:
            risk: the class; a command of another class stays blocked.
            commands: with payload and node; no other command is allowed by this.
        """
        implied = Counter((command, risk) for command in commands)
        self._implied.update(implied)
        self._implications += 1
        try:
            yield
        finally:
            self._implied -= implied
            self._implications += 1

    def assess(self, command: Command) -> Assessment:
        """Return what sending this command may do, payload and node included, and whether it may be sent.

        Assessments are cached until ``revision`` changes.
        """
        revision = self.length_checks.revision + self._implications
        if self._revision != revision:
            self._revision = revision
            self._assessed.clear()
        assessed = self._assessed.get(command)
        if assessed is None:
            assessed = self._evaluate(command)
            consent = self.consent
            if (command, assessed.risk) in self._implied:
                consent = consent._replace(allowed=consent.allowed | {assessed.risk})
            if blocked := why_blocked(assessed, consent, self._names):
                assessed = assessed._replace(blocked=blocked)
            if len(self._assessed) >= _KEPT:
                self._assessed.clear()
            self._assessed[command] = assessed
        return assessed

    @property
    def confirmation_fails(self) -> bool:
        """Whether the class ``brick`` is allowed, but not confirmed with this robot's name."""
        return Risk.BRICK in self.consent.allowed and not _confirms(self.consent, self._names)

    def why_blocked(self, command: Command) -> str | None:
        """Return why this command is blocked and which flag allows it, None when it may be sent."""
        return self.assess(command).blocked or None

    def _evaluate(self, command: Command) -> Assessment:
        rows = rows_of(self.generation, command.did, command.cid)
        if self.robot:
            rows = tuple(row for row in rows if self.robot.key in row.nodes) or rows
        if not rows:
            return self._assess_unknown(command)
        return max((self._assess_row(command, row) for row in rows), key=lambda assessed: assessed.risk)

    def _assess_row(self, command: Command, row: CommandRow) -> Assessment:
        """Assess a command by one of its catalogue rows."""
        if row.kind is Kind.NOTIFICATION:
            return self._assess_unknown(command)
        if row.risk is Risk.READ:
            return Assessment(Risk.READ, "a documented query")
        if row.request is None:
            return Assessment(row.risk, f"{row.name}, whose argument layout is unknown")
        if row.request.accepts(len(command.payload)):
            return Assessment(row.risk, row.name)
        if row.risk > Risk.WRITE:
            return Assessment(row.risk, f"{row.name}: documented, not sent at a wrong length")
        if self.length_checks.is_strict(command.target):
            return Assessment(Risk.PROBE, f"{row.name} at a length it does not take")
        return Assessment(row.risk, f"{row.name} on a robot not known to check lengths")

    def _assess_unknown(self, command: Command) -> Assessment:
        did, cid = command.did, command.cid
        if did in BRICK_DEVICES[self.generation]:
            return Assessment(Risk.BRICK, f"unknown command of the dangerous device 0x{did:02x}")
        if did in PERSIST_DEVICES[self.generation]:
            return Assessment(Risk.PERSIST, f"unknown command of the dangerous device 0x{did:02x}")
        empty_ok = command.payload or did not in NO_EMPTY_PROBE_DEVICES[self.generation]
        if self.length_checks.is_absent(command) and empty_ok:
            return Assessment(Risk.PROBE, "the robot said it does not exist")
        # Not measured yet, only assumed: an empty payload would run a command that exists after all.
        if command.payload and is_impossible(command) and not self.length_checks.is_lenient(command.target):
            return Assessment(Risk.PROBE, "a command that cannot exist")
        by_payload = self._assess_by_payload(command)
        neighbour = _open_ended_neighbours(self.generation).get((did, cid))
        if neighbour and neighbour.risk > by_payload.risk:
            return Assessment(neighbour.risk, f"unknown, next to {neighbour.name}")
        return by_payload

    def _assess_by_payload(self, command: Command) -> Assessment:
        """Assess an unknown command by whether it may accept these bytes."""
        did, payload = command.did, command.payload
        if not is_wrong_length(command, None):
            reason = "unknown command with a payload that it may accept"
            if not payload:
                reason = "unknown command without payload, which may run it"
            if not payload and did in NO_EMPTY_PROBE_DEVICES[self.generation]:
                reason = f"unknown command without payload, like the erasing commands of 0x{did:02x}"
            return Assessment(self._worst_of(did), reason)
        checks, target = self.length_checks, command.target
        if not checks.is_strict(target):
            why = (
                "that accepted a wrong length" if checks.is_lenient(target) else "not known to check lengths"
            )
            return Assessment(self._worst_of(did), f"unknown command on a robot {why}")
        if checks.is_uninformative(target, did):
            why = "unknown command of a device that accepts commands that cannot exist"
            return Assessment(self._worst_of(did), why)
        if self._is_hazardous(did) and not checks.rejections(target, did):
            why = (
                "unknown command of a device that moves or stores; no command of it was seen to check lengths"
            )
            return Assessment(self._worst_of(did), why)
        return Assessment(Risk.PROBE, "unknown command at a length that no command takes")

    def _is_hazardous(self, did: int) -> bool:
        """Whether a documented command of this device moves the robot, lets it sleep or stores something."""
        return _worst_by_device(self.generation).get(did, Risk.READ) >= Risk.MOTION

    def _worst_of(self, did: int) -> Risk:
        return max(Risk.PERSIST, _worst_by_device(self.generation).get(did, Risk.PERSIST))


@cache
def _worst_by_device(generation: Generation) -> dict[int, Risk]:
    """Return DID -> the most dangerous class of its documented commands."""
    worst: dict[int, Risk] = {}
    for row in all_rows(generation):
        worst[row.did] = max(row.risk, worst.get(row.did, row.risk))
    return worst


@cache
def _open_ended_neighbours(generation: Generation) -> dict[tuple[int, int], CommandRow]:
    """Return pair -> the most dangerous command near it that is not known to take one fixed length."""
    near: dict[tuple[int, int], CommandRow] = {}
    for row in all_rows(generation):
        if not _may_take_anything(row):
            continue
        for cid in range(row.cid - NEIGHBOURHOOD, row.cid + NEIGHBOURHOOD + 1):
            known = near.get((row.did, cid))
            if known is None or row.risk > known.risk:
                near[row.did, cid] = row
    return near


def _may_take_anything(row: CommandRow) -> bool:
    """Whether this is a persist or brick command that is not known to take one fixed length."""
    return (
        row.kind is Kind.COMMAND
        and row.risk >= Risk.PERSIST
        and (row.request is None or row.request.fixed_length is None)
    )
