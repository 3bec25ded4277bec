"""Nodes that are there and could not be asked: a run that meets one is not complete."""

from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Finding, Outcome
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Verdict


def is_unreachable(finding: Finding, codec: Codec, robot: Robot | None) -> bool:
    """Whether a finding shows a node that cannot be asked.

    Either the node answered that it is not available, or a node that the model has did not answer an echo.

    Args:
        finding: of any kind; only one that settles nothing can.
        codec: whose codes the answer carries.
        robot: the model, None where it is not known.
    """
    exchange, target = finding.exchange, finding.command.target
    if finding.outcome not in (Outcome.INCONCLUSIVE, Outcome.SILENT):
        return False
    if isinstance(exchange, Answered):
        return codec.verdict(exchange.response.code) is Verdict.TARGET_UNAVAILABLE
    echo = row_for(codec.generation, WellKnown.ECHO)
    is_echo = echo is not None and finding.command[:2] == (echo.did, echo.cid)
    return bool(is_echo and robot and target is not None and Address.from_byte(target).node in robot.nodes)
