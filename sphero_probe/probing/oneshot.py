"""Send one command by itself and judge the answer, without the introduction of a run."""

from collections.abc import Callable
from contextlib import nullcontext
from datetime import UTC, datetime

from sphero_probe import __version__
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Silent
from sphero_probe.link.link import Link
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.link.wrong_lengths import is_wrong_length
from sphero_probe.probing.attempt import Announce, PreparedProbe, ProbeResult
from sphero_probe.probing.finding import Finding, Heading
from sphero_probe.probing.judge import finding_of
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.probing.prober import Prober
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command
from sphero_probe.session.identify import wake
from sphero_probe.session.reconnect import Reconnector


async def send_once(
    link: Link,
    command: Command,
    number: int = 1,
    intend: Callable[[PreparedProbe], None] | None = None,
    announce: Announce | None = None,
) -> Finding:
    """Send exactly this command; if no answer arrives, wake the robot and send it again if its class allows.

    A command that asks for no answer is sent once.

    Args:
        link: to the robot.
        command: to send, with payload and node.
        number: of the finding.
        intend: called before each time the command is sent.
        announce: awaited before a command above the class ``probe`` is sent.

    Raises:
        LinkLostError: the link was lost.
    """
    prober = Prober(Reconnector(link, command.target), command.target)
    prober.intend = intend or prober.intend
    prober.announce = announce
    filled = prober.fill(number, Probe(command, exact=True))
    if is_wrong_length(filled.command, filled.knowledge):
        await prober.calibrations.measure(command.target, [command.did])
        await prober.calibrations.finish([(command.target, command.did)])
    probe = prober.prepare(filled)
    exchange, attempts = await prober.ask(probe, alone=True)
    repeats = probe.risk <= Risk.WRITE and command.options.wants_answer
    while isinstance(exchange, Silent) and attempts < MAX_ATTEMPTS and repeats:
        await wake(link, command.target, 1)
        exchange, more = await prober.ask(probe, alone=True)
        attempts += more
    return finding_of(probe, ProbeResult(exchange, attempts), link.codec, masked=prober.masks(command.target))


async def stop_motors(link: Link, target: int | None, *, always: bool = False) -> None:
    """Stop the robot's motors, if the catalogue has a command for it.

    Args:
        link: to the robot.
        target: the address byte of its usual node.
        always: stop even if motion is not allowed, because a command was executed that may move the robot.

    Raises:
        LinkLostError: the link was lost.
    """
    row = row_for(link.codec.generation, WellKnown.STOP)
    if row is None or row.request is None:
        return
    if not always and Risk.MOTION not in link.policy.consent.allowed:
        return
    robot = link.policy.robot
    nodes = row.nodes.get(robot.key, ()) if robot else ()
    if target is not None and nodes:
        target = Address.from_byte(target).with_node(nodes[0]).byte
    command = Command(row.did, row.cid, row.request.zeros(), target)
    with link.policy.implying(Risk.MOTION, command) if always else nullcontext():
        await link.ask(command, alone=True)


def heading_of(plan: Plan, link: Link, device: str, line: str) -> Heading:
    """Return the heading of a run that begins now, before anything is measured.

    Args:
        plan: to run.
        link: to the robot.
        device: the robot's name or address.
        line: how it is reached, ``BLE`` or ``UART``.
    """
    robot = link.policy.robot
    return Heading(
        robot=robot.key if robot else "",
        model=robot.name if robot else "unknown model",
        device=device,
        firmware={},
        plan=plan.name,
        tool_version=__version__,
        consent=link.policy.consent.words,
        strictness={},
        started=datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z"),
        line=line,
    )
