"""Single commands for one robot: what ``send`` and ``led`` have in common."""

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any

from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.dry_run import planned_rows, tell_dry_run
from sphero_probe.cli.interrupts import Interrupts, run_interruptible
from sphero_probe.cli.keeping import Keeper
from sphero_probe.cli.output import Output
from sphero_probe.cli.session import (
    address_of,
    generation_behind,
    model_behind,
    open_session,
    port_behind,
)
from sphero_probe.errors import LinkLostError, RefusedByPolicyError, RobotRefusedError, SpheroProbeError
from sphero_probe.link.exchange import Answered, Refused, Silent
from sphero_probe.link.guard import Consent
from sphero_probe.probing.finding import Finding, Summary
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.single import ask_single, heading_of, stop_motors
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.reports.rows import finding_row
from sphero_probe.reports.views import FINDING, PLANNED

CommandsFor = Callable[[Robot | None, int], tuple[Command, ...]]
"""Makes the commands from the robot's model, None where it is not known, and the line's port nibble."""


def show_dry(output: Output, device: str, consent: Consent, make: CommandsFor) -> None:
    """Show the bytes that would go out, and touch nothing.

    Raises:
        SpheroProbeError: the command makes no sense for this robot.
    """
    address = address_of(device)
    robot = model_behind(address)
    probes = [Probe(command, exact=True) for command in make(robot, port_behind(address))]
    tell_dry_run()
    rows = planned_rows(Plan("single", "", [probes]), generation_behind(address), robot, consent, None)
    output.show(PLANNED, rows)


def send_each(
    output: Output, device: str, consent: Consent, make: CommandsFor, keeper: Keeper, **connecting: Any
) -> None:
    """Connect, ask each command in turn until one fails, show the findings.

    Raises:
        RefusedByPolicyError: the guard withheld one.
        RobotRefusedError: the robot answered with an error.
        SpheroProbeError: the robot cannot be reached, or did not answer.
    """
    found: list[Finding] = []
    failed: list[SpheroProbeError] = []

    async def work() -> None:
        async with open_session(device, consent, **connecting) as session:
            connection, link = session.connection, session.link
            commands = make(connection.robot, connection.port)
            plan = Plan(keeper.command, "", [[Probe(command, exact=True) for command in commands]])
            keeper.begin(connection, plan, consent, None)
            keeper.record(heading_of(plan, link, connection.name))
            began, frames = monotonic(), link.frames_sent
            try:
                for number, command in enumerate(commands, 1):
                    finding = await ask_single(link, command, number, keeper.intend)
                    found.append(finding)
                    keeper.record(finding)
                    complain(finding, link.codec)
            except (RefusedByPolicyError, RobotRefusedError, NoAnswerError) as error:
                failed.append(error)
            finally:
                with suppress(LinkLostError):
                    await stop_motors(link, commands[0].target)
            counts = dict(Counter(finding.outcome for finding in found))
            complete = len(found) == len(commands)
            keeper.record(Summary(counts, monotonic() - began, link.frames_sent - frames, complete))

    with keeper:
        run_interruptible(Interrupts(), work())
    output.show(FINDING, map(finding_row, found))
    if failed:
        raise failed[0]


class NoAnswerError(SpheroProbeError):
    """A single command stayed without an answer."""


def complain(finding: Finding, codec: Codec) -> None:
    """Turn a finding that is no success into the error that ends the command.

    Raises:
        RefusedByPolicyError: the guard withheld the command.
        RobotRefusedError: the robot answered with an error.
        NoAnswerError: nobody answered.
    """
    exchange = finding.exchange
    if isinstance(exchange, Refused):
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
