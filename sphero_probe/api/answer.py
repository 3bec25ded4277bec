"""The answer to one command, which ``robot.send`` returns."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from sphero_probe.api.named_fields import NamedFields
from sphero_probe.catalogue.meaning import answer_meaning
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Verdict


@dataclass(frozen=True, slots=True)
class Answer(NamedFields):
    """How one command ended.

    The decoded fields can be read by name: ``answer.percentage``, or ``answer["percentage"]`` where the name
    is also an attribute below.

    Attributes:
        command: the command that was sent, with its node.
        name: the command's name in the catalogue, None where it has none.
        ok: whether the robot reported success.
        outcome: what the answer proves about the command: ``exists``, ``absent``, ``silent``, ``skipped``
            (our policy blocked it) or ``inconclusive``.
        code: the response code, 0-255; None without an answer.
        code_name: the code in words, empty without an answer.
        fields: the decoded fields of a successful answer; empty where no layout is known.
        units: field name -> its unit, for the fields that have one.
        payload: the data bytes of the answer, empty without an answer.
        rtt: seconds from sending to the answer, None without an answer.
        note: a remark, or empty.
        finding: the same as a finding of a run, with the frames of the exchange.
    """

    command: Command
    name: str | None
    ok: bool
    outcome: Outcome
    code: int | None
    code_name: str
    fields: Mapping[str, object]
    units: Mapping[str, str]
    payload: bytes
    rtt: float | None
    note: str
    finding: Finding

    @classmethod
    def of(cls, finding: Finding, codec: Codec) -> Self:
        """Return a finding as an answer.

        Args:
            finding: the finding of a single command.
            codec: the codec of the robot's protocol.
        """
        exchange = finding.exchange
        answered = exchange if isinstance(exchange, Answered) else None
        decoded = answer_meaning(answered.response, finding.knowledge) if answered else None
        notes = (finding.note, decoded.problem if decoded else "")
        return cls(
            command=finding.command,
            name=finding.name,
            ok=answered is not None and codec.verdict(answered.response.code) is Verdict.OK,
            outcome=finding.outcome,
            code=finding.code,
            code_name=finding.code_name,
            fields=decoded.fields if decoded else {},
            units=decoded.units if decoded else {},
            payload=finding.payload,
            rtt=answered.rtt if answered else None,
            note="; ".join(filter(None, notes)),
            finding=finding,
        )

    def __str__(self) -> str:
        """Return one line of text; text from the robot is quoted."""
        name = self.name or f"0x{self.command.did:02x}:0x{self.command.cid:02x}"
        said = self.code_name or self.outcome.value
        values = (f"{key} {value!r} {self.units.get(key, '')}".rstrip() for key, value in self.fields.items())
        return f"{name}: {said}{': ' if self.fields else ''}{', '.join(values)}"
