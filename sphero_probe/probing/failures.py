"""Raise an error for a command that was sent by itself and did not succeed."""

from sphero_probe.catalogue.well_known import WellKnown
from sphero_probe.errors import CommandSilentError, NoAnswerError, RefusedByPolicyError, RobotRefusedError
from sphero_probe.link.exchange import Answered, Blocked, Silent
from sphero_probe.link.link import Link
from sphero_probe.probing.finding import Finding
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Verdict
from sphero_probe.session.identify import ask_well_known
from sphero_probe.session.session import Session
from sphero_probe.simulator.recorded import is_not_recorded


async def check(finding: Finding, session: Session) -> None:
    """Raise the error for a finding; return if the command succeeded.

    After silence, if the robot has answered nothing before, an echo checks whether it answers at all.

    Args:
        finding: of a command that was sent by itself.
        session: with the robot.

    Raises:
        RefusedByPolicyError: our policy blocked the command; nothing was sent.
        RobotRefusedError: the robot rejected the command.
        CommandSilentError: the robot answers other commands, but not this one.
        NoAnswerError: the robot answers nothing at all.
        LinkLostError: the connection was lost.
    """
    exchange, link = finding.exchange, session.link
    if isinstance(exchange, Blocked):
        raise RefusedByPolicyError(f"not sent: {exchange.reason}")
    if isinstance(exchange, Silent) and exchange.command.options.wants_answer:
        command = exchange.command
        tries = "1 attempt" if finding.attempts == 1 else f"{finding.attempts} attempts"
        silence = f"no answer to 0x{command.did:02x}:0x{command.cid:02x} in {tries}"
        if not link.answers:
            await ask_well_known(link, WellKnown.ECHO, session.target, attempts=1)
        if not link.answers:
            raise NoAnswerError(
                f"{silence}, nor to an echo: the robot is connected and answers nothing",
                "shake it, or put it on its charger and take it off; or try a longer --timeout",
            )
        raise CommandSilentError(
            f"{silence}; the robot answers other commands", "try a longer --timeout, or another --target"
        )
    if isinstance(exchange, Answered) and link.codec.verdict(exchange.response.code) is not Verdict.OK:
        code = exchange.response.code
        if is_not_recorded(exchange.response):
            raise RobotRefusedError(
                "the recording has no answer to this command", "a sweep lists what it has"
            )
        raise RobotRefusedError(
            f"the robot answered 0x{code:02x} {finding.code_name}",
            _other_node(finding, link)
            or f"see: sphero-probe explain {'--v1 ' if link.codec.generation == 'v1' else ''}0x{code:02x}",
        )


def _other_node(finding: Finding, link: Link) -> str:
    """Return the hint to ask another node, if the catalogue knows the command there and not on this one."""
    robot, known, target = link.policy.robot, finding.knowledge, finding.command.target
    if robot is None or known is None or target is None or finding.code is None:
        return ""
    nodes = known.nodes.get(robot.key, ())
    if not nodes or Address.from_byte(target).node in nodes:
        return ""
    if link.codec.verdict(finding.code) not in (Verdict.NO_DEVICE, Verdict.NO_COMMAND, Verdict.NO_TARGET):
        return ""
    there = Address.from_byte(target).with_node(nodes[0])
    name = robot.nodes.get(there.node, f"0x{there.byte:02x}")
    return f"the catalogue knows {known.name} on another node: --target {name}"
