"""The records of a run, as values: a heading, one finding per probe, notes, and a summary."""

from collections.abc import Mapping
from enum import StrEnum
from typing import NamedTuple

from sphero_probe.catalogue.meaning import answer_meaning
from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered, Exchange
from sphero_probe.protocol.packets import Command


class Outcome(StrEnum):
    """What a probe proved about its command."""

    EXISTS = "exists"
    ABSENT = "absent"
    SILENT = "silent"
    SKIPPED = "skipped"
    INCONCLUSIVE = "inconclusive"
    SENT = "sent"
    """No answer was asked for, so that silence says nothing; only a single command ends so."""

    # That of an enumeration is written in Python, and every finding is counted.
    __hash__ = str.__hash__


class Confidence(StrEnum):
    """How far an outcome can be trusted."""

    CERTAIN = "certain"
    MAYBE = "maybe"


class Finding(NamedTuple):
    """The result of one probe.

    Attributes:
        number: place of the probe in the run, from 1.
        command: the command that was sent, or would have been.
        outcome: what the exchange proves.
        confidence: how far to trust the outcome.
        risk: the class of the command with this payload.
        exchange: how sending the command ended.
        knowledge: the catalogue's row for this robot, None if no catalogue knows the pair.
        code_name: the name of the answer's code, empty without an answer.
        attempts: how often it was sent.
        note: a remark, or empty.
    """

    number: int
    command: Command
    outcome: Outcome
    confidence: Confidence
    risk: Risk
    exchange: Exchange
    knowledge: CommandRow | None
    code_name: str = ""
    attempts: int = 0
    note: str = ""

    @property
    def name(self) -> str | None:
        """The command's name in the catalogue, None if no catalogue knows it."""
        return self.knowledge.name if self.knowledge else None

    @property
    def answered_by(self) -> int | None:
        """Address byte of the node that answered, as its response names it; None where none does."""
        return self.exchange.response.source if isinstance(self.exchange, Answered) else None

    @property
    def code(self) -> int | None:
        """The answer's code, None without an answer."""
        return self.exchange.response.code if isinstance(self.exchange, Answered) else None

    @property
    def payload(self) -> bytes:
        """The answer's data bytes, empty without an answer."""
        return self.exchange.response.payload if isinstance(self.exchange, Answered) else b""

    @property
    def fields(self) -> dict[str, object]:
        """The fields of a successful answer by the catalogue's layout; empty if there are none."""
        if not isinstance(self.exchange, Answered):
            return {}
        return answer_meaning(self.exchange.response, self.knowledge).fields


class Note(NamedTuple):
    """Anything else that happened: a notification, a late answer, a malformed frame, a step of the run.

    Attributes:
        kind: ``notification``, ``late``, ``malformed``, ``calibration``, ``evidence``, ``executed``,
            ``comparison``, ``exchanges``, ``run``.
        text: one line for the user.
        data: JSON-able details; bytes as hex strings. What a robot sent unsolicited has ``time``, in RFC 3339
            UTC, and the keys of ``packet_json``; in journals of version 0.1.0 it has some of them.
    """

    kind: str
    text: str
    data: dict[str, object]


class Heading(NamedTuple):
    """What a run is about: the robot, the plan and the consent.

    Attributes:
        robot: the model's key, ``bolt-plus``.
        model: the model's name.
        device: the advertised name or the address that was given.
        firmware: node name -> version text, for the nodes that answered.
        plan: the plan's name.
        tool_version: of sphero-probe.
        consent: the allowed risk classes, by name.
        strictness: node name -> what calibration measured before the first stage, empty if it was not needed.
            ``Summary`` has it for all nodes.
        started: RFC 3339 UTC.
        line: how the robot is reached, ``BLE`` or ``UART``; empty in journals of version 0.1.0.
        client: address byte under which the robot sees the client, None where its answers do not tell.
    """

    robot: str
    model: str
    device: str
    firmware: dict[str, str]
    plan: str
    tool_version: str
    consent: tuple[str, ...]
    strictness: dict[str, str]
    started: str
    line: str = ""
    client: int | None = None


class Summary(NamedTuple):
    """The end of a run.

    Attributes:
        counts: outcome -> number of findings.
        seconds: how long it took.
        probes_sent: probes that were sent, each counted once.
        frames_sent: command frames sent, with retries, calibration and health checks.
        complete: False if the run ended early or could not probe everything.
        strictness: node name -> what calibration measured, for all nodes of the run; empty in journals of
            version 0.1.0.
    """

    counts: dict[Outcome, int]
    seconds: float
    probes_sent: int
    frames_sent: int
    complete: bool = True
    strictness: Mapping[str, str] = {}


Record = Heading | Finding | Note | Summary
