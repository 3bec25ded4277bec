"""One command for one robot: what ``send`` and ``led`` have in common."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.dry_run import model_behind, planned_rows, tell_dry_run
from sphero_probe.cli.interrupts import Interrupts, run_interruptible
from sphero_probe.cli.output import Output
from sphero_probe.cli.session import address_of, open_session
from sphero_probe.errors import LinkLostError, RefusedByPolicyError, RobotRefusedError, SpheroProbeError
from sphero_probe.link.exchange import Answered, Refused, Silent
from sphero_probe.link.guard import Consent
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.single import ask_single, stop_motors
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Verdict
from sphero_probe.reports.rows import finding_row
from sphero_probe.reports.views import FINDING, PLANNED

CommandFor = Callable[[Robot | None, int], Command]
"""Makes the command from the robot's model, None where it is not known, and the line's port nibble."""


def show_dry(output: Output, device: str, consent: Consent, make: CommandFor) -> None:
    """Show the bytes that would go out, and touch nothing.

    Raises:
        SpheroProbeError: the command makes no sense for this robot.
    """
    robot = model_behind(address_of(device))
    plan = Plan("single", "", [[Probe(make(robot, 1), exact=True)]])
    tell_dry_run()
    output.show(PLANNED, planned_rows(plan, Generation.V2, robot, consent, None))


def send_single(output: Output, device: str, consent: Consent, make: CommandFor, **connecting: Any) -> None:
    """Connect, ask one command, show its finding.

    Raises:
        RefusedByPolicyError: the guard withheld it.
        RobotRefusedError: the robot answered with an error.
        SpheroProbeError: the robot cannot be reached, or did not answer.
    """
    found: list[Finding] = []

    async def work() -> None:
        async with open_session(device, consent, **connecting) as (connection, link):
            command = make(connection.robot, connection.port)
            try:
                found.append(await ask_single(link, command))
            finally:
                with suppress(LinkLostError):
                    await stop_motors(link, command.target)

    run_interruptible(Interrupts(), work())
    output.show(FINDING, map(finding_row, found))
    _complain(found[0])


def _complain(finding: Finding) -> None:
    exchange = finding.exchange
    if isinstance(exchange, Refused):
        raise RefusedByPolicyError(f"not sent: {exchange.reason}")
    if isinstance(exchange, Silent):
        raise SpheroProbeError(
            f"no answer to {finding.attempts} attempts", "is it awake? try a longer --timeout"
        )
    if isinstance(exchange, Answered):
        code = exchange.response.code
        codec = CODECS[Generation.V2]
        if codec.verdict(code) is not Verdict.OK:
            raise RobotRefusedError(
                f"the robot answered 0x{code:02x} {finding.code_name}",
                f"see: sphero-probe explain 0x{code:02x}",
            )
