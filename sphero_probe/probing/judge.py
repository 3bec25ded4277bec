"""What an exchange proves about a command: an exchange in, an outcome and a remark out."""

from typing import Final, NamedTuple, assert_never

from sphero_probe.link.exchange import Answered, Blocked, Exchange, Silent
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.finding import Confidence, Finding, Outcome
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Verdict


class Judgement(NamedTuple):
    """What one exchange proves.

    Attributes:
        outcome: the word.
        confidence: how far to trust it.
        note: a remark, or empty.
    """

    outcome: Outcome
    confidence: Confidence = Confidence.CERTAIN
    note: str = ""


_BY_VERDICT: Final[dict[Verdict, Judgement]] = {
    Verdict.OK: Judgement(Outcome.EXISTS),
    Verdict.NOT_IMPLEMENTED: Judgement(Outcome.EXISTS, note="a stub"),
    Verdict.RESTRICTED: Judgement(Outcome.EXISTS, note="not in this state or mode"),
    Verdict.BAD_LENGTH: Judgement(Outcome.EXISTS),
    Verdict.FAILED: Judgement(Outcome.EXISTS, note="ran and failed"),
    Verdict.BAD_VALUE: Judgement(Outcome.EXISTS, note="a value was refused"),
    Verdict.NO_DEVICE: Judgement(Outcome.ABSENT),
    Verdict.NO_COMMAND: Judgement(Outcome.ABSENT),
    Verdict.NO_TARGET: Judgement(Outcome.ABSENT, note="no such node"),
    Verdict.BUSY: Judgement(Outcome.INCONCLUSIVE, note="busy whenever it was asked"),
    Verdict.TARGET_UNAVAILABLE: Judgement(Outcome.INCONCLUSIVE, note="the node is asleep or disconnected"),
    Verdict.DAMAGED: Judgement(Outcome.INCONCLUSIVE, note="the robot received it damaged"),
    Verdict.UNLISTED: Judgement(Outcome.INCONCLUSIVE, note="a code in no document"),
}


def judge(exchange: Exchange, codec: Codec, *, masked: bool = False) -> Judgement:
    """Return what an exchange proves.

    Args:
        exchange: how asking ended.
        codec: whose codes the answer carries.
        masked: this node may answer "bad length" to commands that do not exist, too.
    """
    match exchange:
        case Answered(response=response):
            verdict = codec.verdict(response.code)
            judgement = _BY_VERDICT[verdict]
            if masked and verdict is Verdict.BAD_LENGTH:
                return Judgement(
                    Outcome.EXISTS,
                    Confidence.MAYBE,
                    "this robot may say so of commands that do not exist, too",
                )
            return judgement
        case Silent():
            return Judgement(Outcome.SILENT)
        case Blocked(reason=reason):
            return Judgement(Outcome.SKIPPED, note=reason)
        case _:
            assert_never(exchange)


def finding_of(asked: PreparedProbe, tried: ProbeResult, codec: Codec, *, masked: bool = False) -> Finding:
    """Return the finding of a probe.

    Args:
        asked: the probe.
        tried: how asking it ended.
        codec: whose codes the answer carries.
        masked: see ``judge``.
    """
    exchange, attempts = tried
    judgement = judge(exchange, codec, masked=masked)
    return Finding(
        asked.number,
        asked.command,
        judgement.outcome,
        judgement.confidence,
        asked.risk,
        exchange,
        asked.knowledge,
        codec.code_name(exchange.response.code) if isinstance(exchange, Answered) else "",
        attempts,
        judgement.note,
    )
