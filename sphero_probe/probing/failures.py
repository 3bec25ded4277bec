"""When one command is all that was asked: the finding that is no success becomes an error."""

from sphero_probe.errors import NoAnswerError, RefusedByPolicyError, RobotRefusedError
from sphero_probe.link.exchange import Answered, Blocked, Silent
from sphero_probe.probing.finding import Finding
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Verdict


def check(finding: Finding, codec: Codec) -> None:
    """Raise the error that a finding stands for; return where the command succeeded.

    Args:
        finding: of a command that was sent by itself.
        codec: of the robot's protocol, which says what an answer's code means.

    Raises:
        RefusedByPolicyError: our policy blocked the command; nothing was sent.
        RobotRefusedError: the robot answered with an error.
        NoAnswerError: no answer came.
    """
    exchange = finding.exchange
    if isinstance(exchange, Blocked):
        raise RefusedByPolicyError(f"not sent: {exchange.reason}")
    if isinstance(exchange, Silent):
        raise NoAnswerError(
            f"no answer to {finding.attempts} attempts", "is it awake? try a longer --timeout"
        )
    if isinstance(exchange, Answered) and codec.verdict(exchange.response.code) is not Verdict.OK:
        code = exchange.response.code
        raise RobotRefusedError(
            f"the robot answered 0x{code:02x} {finding.code_name}",
            f"see: sphero-probe explain {'--v1 ' if codec.generation == 'v1' else ''}0x{code:02x}",
        )
