"""The one gate: it decides what may be sent to a robot.

Everything that is sent passes ``Policy.assess``. What a command may do is judged from the
catalogue and from what calibration measured; where both are silent, the more dangerous class is taken.
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
from sphero_probe.protocol.packets import Command, Generation

WRONG_LENGTH: Final = 11
"""Length of a probe's payload: no documented command takes it, and it fills one 20-byte BLE write."""
WRONG_LENGTHS: Final = frozenset({11, 13, 40})
"""Lengths that no documented fixed-length command takes [commands_v2]."""
NEIGHBOURHOOD: Final = 2
"""An unknown command this close to a variable-length persist or brick command takes its class."""
_KEPT: Final = 1024
"""Assessments that a policy keeps."""


class Assessment(NamedTuple):
    """What sending a command may do, and whether it may be sent.

    Attributes:
        risk: the class.
        reason: why it is that class, a phrase.
        blocked: why it must not be sent and which flag allows it; empty when it may be sent.
    """

    risk: Risk
    reason: str
    blocked: str = ""


class Consent(NamedTuple):
    """What a person has allowed.

    Attributes:
        allowed: risk classes; each is allowed by its own name.
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


def why_blocked(assessment: Assessment, consent: Consent, robot_names: Iterable[str]) -> str | None:
    """Return why a command of this class is withheld and which flag allows it, None when it may go.

    Args:
        assessment: what the command may do.
        consent: what was allowed.
        robot_names: the names that ``--confirm`` may repeat.
    """
    risk, reason, _ = assessment
    if risk not in consent.allowed:
        flag = f"--allow {risk.word}"
        if risk is Risk.BRICK:
            flag += " --confirm NAME-OF-ROBOT"
        return f"{risk.word}: {reason} ({flag})"
    if risk is Risk.BRICK and (not consent.confirmed or consent.confirmed not in set(robot_names)):
        return f"brick: {reason} (--confirm wants this robot's name)"
    return None


class Policy:
    """The gate of one link: consent, the robot's catalogue, and what was measured on the robot.

    Attributes:
        consent: what a person has allowed.
        robot: the model, None where it is not known.
        revision: changes whenever a measurement changes what may be sent.
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
        self.revision = 0
        self._generation = generation
        self._names = tuple(names)
        self._strict: set[int | None] = set()
        self._absent: set[Command] = set()
        self._assessed: dict[Command, Assessment] = {}
        self._implied: Counter[tuple[Command, Risk]] = Counter()

    @contextmanager
    def implying(self, risk: Risk, *commands: Command) -> Iterator[None]:
        """Allow a class for exactly these commands, as asking for a lamp's colour implies writing it.

        Args:
            risk: the class that what was asked for implies.
            commands: payload and node included; no other command profits.
        """
        asked = Counter((command, risk) for command in commands)
        self._implied.update(asked)
        self._revise()
        try:
            yield
        finally:
            self._implied -= asked
            self._revise()

    def trust_length_check(self, target: int | None) -> None:
        """Take in that this node was measured to refuse wrong lengths without executing."""
        self._strict.add(target)
        self._revise()

    def distrust_length_check(self, target: int | None) -> None:
        """Take back what ``trust_length_check`` said."""
        self._strict.discard(target)
        self._revise()

    def take_as_absent(self, command: Command) -> None:
        """Take in that the robot said of this pair, on this node, that it does not exist."""
        self._absent.add(command._replace(payload=b""))
        self._revise()

    def assess(self, command: Command) -> Assessment:
        """Return what sending this command may do, payload and node included, and whether it may be sent.

        The last assessments are kept until a measurement changes them: asking again costs little.
        """
        assessed = self._assessed.get(command)
        if assessed is None:
            assessed = self._evaluate(command)
            consent = self.consent
            if self._implied[command, assessed.risk]:
                consent = consent._replace(allowed=consent.allowed | {assessed.risk})
            blocked = why_blocked(assessed, consent, self._names) or ""
            assessed = assessed._replace(blocked=blocked)
            if len(self._assessed) >= _KEPT:
                self._assessed.clear()
            self._assessed[command] = assessed
        return assessed

    def why_blocked(self, command: Command) -> str | None:
        """Return why this command is blocked and which flag allows it, None when it may be sent."""
        return self.assess(command).blocked or None

    def _revise(self) -> None:
        self.revision += 1
        self._assessed.clear()

    def _evaluate(self, command: Command) -> Assessment:
        rows = rows_of(self._generation, command.did, command.cid)
        if self.robot:
            rows = tuple(row for row in rows if self.robot.key in row.nodes) or rows
        if not rows:
            return self._assess_unknown(command)
        return max((self._assess_row(command, row) for row in rows), key=lambda assessed: assessed.risk)

    def _assess_row(self, command: Command, row: CommandRow) -> Assessment:
        """Judge by what one row says that the pair means; where several may apply, the worst counts."""
        if row.kind is Kind.NOTIFICATION:
            return self._assess_unknown(command)
        if row.risk is Risk.READ:
            return Assessment(Risk.READ, "a documented query")
        if row.request is None:
            return Assessment(row.risk, f"{row.name}, whose argument layout is unknown")
        if row.request.accepts(len(command.payload)):
            return Assessment(row.risk, row.name)
        if row.risk is Risk.BRICK:
            return Assessment(Risk.BRICK, f"{row.name}, not even at a wrong length")
        if command.target in self._strict:
            return Assessment(Risk.PROBE, f"{row.name} at a length it does not take")
        return Assessment(row.risk, f"{row.name} on a robot not known to check lengths")

    def _assess_unknown(self, command: Command) -> Assessment:
        did, cid, target = command.did, command.cid, command.target
        if did in BRICK_DEVICES[self._generation]:
            return Assessment(Risk.BRICK, f"unknown command of the dangerous device 0x{did:02x}")
        if did in PERSIST_DEVICES[self._generation]:
            return Assessment(Risk.PERSIST, f"unknown command of the dangerous device 0x{did:02x}")
        if Command(did, cid, b"", target) in self._absent:
            return Assessment(Risk.PROBE, "the robot said it does not exist")
        by_payload = self._assess_by_payload(command)
        neighbour = _open_ended_neighbours(self._generation).get((did, cid))
        if neighbour and neighbour.risk > by_payload.risk:
            return Assessment(neighbour.risk, f"unknown, next to {neighbour.name}")
        return by_payload

    def _assess_by_payload(self, command: Command) -> Assessment:
        """Judge an unknown command by whether it may accept these bytes."""
        did, payload = command.did, command.payload
        if not is_wrong_length(command, None):
            reason = "unknown command with a payload that it may accept"
            if not payload and did in NO_EMPTY_PROBE_DEVICES[self._generation]:
                reason = f"unknown command without payload, as the erasing ones of 0x{did:02x} take it"
            return Assessment(self._worst_of(did), reason)
        if command.target not in self._strict:
            return Assessment(self._worst_of(did), "unknown command on a robot not known to check lengths")
        return Assessment(Risk.PROBE, "unknown command at a length that no command takes")

    def _worst_of(self, did: int) -> Risk:
        return max(Risk.PERSIST, _worst_by_device(self._generation).get(did, Risk.PERSIST))


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


def is_wrong_length(command: Command, row: CommandRow | None) -> bool:
    """Whether a command is harmless only where its node refuses wrong lengths without executing.

    Args:
        command: with its payload.
        row: what is known of the pair, None where nothing is.
    """
    length = len(command.payload)
    if row is None or row.kind is Kind.NOTIFICATION:
        return length in WRONG_LENGTHS and not any(command.payload)
    refusable = row.request is not None and not row.request.accepts(length)
    return refusable and Risk.READ < row.risk < Risk.BRICK


def _may_take_anything(row: CommandRow) -> bool:
    """Whether this is a persist or brick command that is not known to take one fixed length."""
    return (
        row.kind is Kind.COMMAND
        and row.risk >= Risk.PERSIST
        and (row.request is None or row.request.fixed_length is None)
    )
