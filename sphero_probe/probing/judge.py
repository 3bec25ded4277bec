"""Judge what an exchange proves about a command."""

from typing import Final, NamedTuple, assert_never

from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.catalogue.provenance import absence_note
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.link.wrong_lengths import is_impossible
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.finding import Confidence, Finding, Outcome
from sphero_probe.probing.profiles import GONE, Answer, DeviceProfile
from sphero_probe.probing.readings import EXPECTED
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Response, Verdict
from sphero_probe.simulator.recorded import is_not_recorded


class Judgement(NamedTuple):
    """What one exchange proves.

    Attributes:
        outcome: of the probe.
        confidence: how far to trust it.
        note: a remark, or empty.
    """

    outcome: Outcome
    confidence: Confidence = Confidence.CERTAIN
    note: str = ""


_MASKED: Final = "commands that cannot exist get the same answer"
_SENT: Final = {
    False: "no answer was asked for",
    True: "an answer was asked for on error only, and none came",
}
"""Whether a command asked for errors only -> why its silence says nothing."""
_UNCONFIRMED: Final = f"documented, not confirmed: {_MASKED}"
_BY_VERDICT: Final[dict[Verdict, Judgement]] = {
    Verdict.OK: Judgement(Outcome.EXISTS),
    Verdict.NOT_IMPLEMENTED: Judgement(Outcome.EXISTS, note="a stub or null handler"),
    Verdict.RESTRICTED: Judgement(Outcome.EXISTS, note="not available in this state or mode"),
    Verdict.BAD_LENGTH: Judgement(Outcome.EXISTS),
    Verdict.FAILED: Judgement(Outcome.EXISTS, note="ran and failed"),
    Verdict.BAD_VALUE: Judgement(Outcome.EXISTS, note="a value was rejected"),
    Verdict.NO_DEVICE: Judgement(Outcome.ABSENT),
    Verdict.NO_COMMAND: Judgement(Outcome.ABSENT),
    Verdict.NO_TARGET: Judgement(Outcome.ABSENT, note="no such node"),
    Verdict.BUSY: Judgement(Outcome.INCONCLUSIVE, note="busy each time it was sent"),
    Verdict.TARGET_UNAVAILABLE: Judgement(Outcome.INCONCLUSIVE, note="the node is asleep or disconnected"),
    Verdict.DAMAGED: Judgement(Outcome.INCONCLUSIVE, note="the robot received it damaged"),
    Verdict.UNLISTED: Judgement(Outcome.INCONCLUSIVE, note="a code in no document"),
}


def judge(
    exchange: Exchange,
    codec: Codec,
    *,
    known: bool = False,
    reading: bool = False,
    masked: bool = False,
    device: DeviceProfile | None = None,
) -> Judgement:
    """Return what an exchange proves.

    An answer proves nothing if commands that cannot exist get the same one.

    Args:
        exchange: how sending the command ended.
        codec: of the robot's protocol.
        known: the catalogue knows the command.
        reading: its answer is known to carry data.
        masked: the node may answer "bad length" to commands that do not exist; used if the device was not
            measured.
        device: what calibration measured of the command's device, None if it was not measured.
    """
    match exchange:
        case Answered(command=command, response=response):
            verdict = codec.verdict(response.code)
            if _asked_for_code(command, response, codec):
                return Judgement(Outcome.EXISTS, note="answered with the code it was asked for")
            if is_not_recorded(response):
                return Judgement(Outcome.INCONCLUSIVE, note="not recorded")
            if verdict in GONE or verdict is Verdict.NO_TARGET:
                return _BY_VERDICT[verdict]
            if is_impossible(command) and not known:
                return Judgement(Outcome.INCONCLUSIVE, note="a command that cannot exist gets this answer")
            length = len(command.payload)
            if device and device.knows_impossible:
                masked = device.to_impossible(length) == Answer(response.code, response.payload)
            else:
                masked = masked and verdict is Verdict.BAD_LENGTH
            if masked:
                return Judgement(Outcome.INCONCLUSIVE, note=_UNCONFIRMED if known else _MASKED)
            if verdict is Verdict.OK and reading and not response.payload:
                return Judgement(Outcome.EXISTS, note=EXPECTED)
            return _BY_VERDICT[verdict]
        case Silent(command=command) if not command.options.wants_answer:
            return Judgement(Outcome.SENT, note=_SENT[command.options.only_errors])
        case Silent(command=command):
            length = len(command.payload)
            if device and device.knows_impossible and device.to_impossible(length) is None:
                return Judgement(Outcome.INCONCLUSIVE, note="commands that cannot exist are silent, too")
            return Judgement(Outcome.SILENT)
        case Blocked(reason=reason):
            return Judgement(Outcome.SKIPPED, note=reason)
        case _:
            assert_never(exchange)


def _asked_for_code(command: Command, response: Response, codec: Codec) -> bool:
    """Whether the answer is the error code that the robot was asked to answer with."""
    if response.code == 0 or command.payload != bytes([response.code]):
        return False
    row = row_for(codec.generation, WellKnown.ERROR_ON_DEMAND)
    return row is not None and command[:2] == (row.did, row.cid)


def finding_of(
    probe: PreparedProbe,
    result: ProbeResult,
    codec: Codec,
    *,
    masked: bool = False,
    device: DeviceProfile | None = None,
    robot: Robot | None = None,
    firmware: str = "",
) -> Finding:
    """Return the finding of a probe.

    Args:
        probe: the probe.
        result: how it ended.
        codec: of the robot's protocol.
        masked: see ``judge``.
        device: see ``judge``.
        robot: the model; an absent command gets a note on what is known about it for this model.
        firmware: the version of the probed node, empty if it is not known.
    """
    exchange, attempts = result
    known = probe.knowledge is not None and probe.knowledge.kind is Kind.COMMAND
    layout = probe.knowledge.response if probe.knowledge and known else None
    reading = layout is not None and layout.minimum_length > 0 and probe.risk is Risk.READ
    judgement = judge(exchange, codec, known=known, reading=reading, masked=masked, device=device)
    is_missing = judgement.outcome is Outcome.ABSENT and not judgement.note  # the command, not the node
    return Finding(
        probe.number,
        probe.command,
        judgement.outcome,
        judgement.confidence,
        exchange.risk if isinstance(exchange, Blocked) else probe.risk,
        exchange,
        probe.knowledge,
        codec.code_name(exchange.response.code) if isinstance(exchange, Answered) else "",
        attempts,
        absence_note(probe.knowledge, robot, firmware) if is_missing else judgement.note,
    )
