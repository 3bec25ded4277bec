"""``listen``: send the commands of ``--send``, then print every unsolicited packet as it arrives."""

import asyncio

from sphero_probe.cli.command_words import parse_command
from sphero_probe.cli.connect import connect
from sphero_probe.cli.listening import CountedReport, switch_off, wait_for_end
from sphero_probe.cli.output import report
from sphero_probe.cli.signals import Interrupts, run_interruptible
from sphero_probe.cli.values import AskOptions, ConnectOptions, Output
from sphero_probe.link.exchange import Unsolicited
from sphero_probe.link.policy import Consent
from sphero_probe.link.unsolicited import describe_unsolicited
from sphero_probe.probing.failures import check
from sphero_probe.probing.oneshot import send_once
from sphero_probe.protocol.packets import Command
from sphero_probe.reports.rows import Row
from sphero_probe.reports.views import HEARD
from sphero_probe.session.commands import complete_command
from sphero_probe.session.session import Session


def listen(
    output: Output,
    connecting: ConnectOptions,
    asking: AskOptions,
    commands: tuple[str, ...],
    *,
    count: int | None,
    seconds: float | None,
) -> None:
    """Print unsolicited packets until there are enough, the time is up, or Ctrl-C.

    Args:
        output: where and how to print.
        connecting: which robot.
        asking: what ``commands`` may do.
        commands: to send first, each as typed.
        count: of packets to stop after, None for any number.
        seconds: to listen after the commands were sent, None for no limit.

    Raises:
        SpheroProbeError: the robot cannot be reached, is gone, or did not accept a command.
        OSError: the report cannot be written.
    """
    interrupts = Interrupts()
    stop = asyncio.Event()

    async def work() -> None:
        interrupts.stop_politely(stop)
        async with connect(connecting, Consent.of(asking.allow, asking.confirm)) as session:
            lines = output if output.chosen or output.file else output._replace(chosen="plain")
            with report(lines, HEARD, live=True) as rows:
                packets = CountedReport(rows, count, stop)

                def hear(_: Unsolicited, described: dict[str, object]) -> None:
                    packets.add(Row("packet", described))

                executed: list[Command] = []
                try:
                    with describe_unsolicited(session.link, hear):
                        for text in commands:
                            await _send(session, text, executed)
                        await wait_for_end(session, stop, seconds)
                finally:
                    await switch_off(session, executed)
                packets.raise_failure()

    run_interruptible(interrupts, work())


async def _send(session: Session, text: str, executed: list[Command]) -> None:
    """Send a command that was given as text, and add it to what was executed.

    Raises:
        SpheroProbeError: it is not valid, is blocked, or the robot rejected it.
    """
    connection = session.connection
    typed = parse_command(tuple(text.split()), connection.generation)
    command = complete_command(
        *(typed.ids, typed.payload(connection.robot), connection.robot, connection.port, None),
        generation=connection.generation,
    )
    executed.append(command)
    await check(await send_once(session.link, command), session)
