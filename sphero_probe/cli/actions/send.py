"""``send``: send one command and print the answer."""

from sphero_probe.catalogue.model import Robot
from sphero_probe.cli.command_words import parse_command
from sphero_probe.cli.oneshot import send_commands
from sphero_probe.cli.values import AskOptions, ConnectOptions, FlagOptions, JournalOptions, Output
from sphero_probe.link.policy import Consent
from sphero_probe.protocol.packets import Command
from sphero_probe.session.addressing import address_of, generation_behind
from sphero_probe.session.commands import complete_command, send_options


def send(
    output: Output,
    journal: JournalOptions,
    connecting: ConnectOptions,
    asking: AskOptions,
    flags: FlagOptions,
    what: tuple[str, ...],
) -> None:
    """Send one command and show the answer, or show what would be sent.

    Args:
        output: where and how to show the finding.
        journal: which journal to keep.
        connecting: which robot.
        asking: what is allowed, and which node.
        flags: the flags and the source address.
        what: the words of the command, as typed.

    Raises:
        SpheroProbeError: the words are not a command, or the command failed.
    """
    generation = generation_behind(address_of(connecting.device))
    options = send_options(
        generation,
        answer=not flags.no_answer,
        only_errors=flags.only_errors,
        activity=not flags.no_activity,
        source=flags.source,
    )
    typed = parse_command(what, generation)
    typed.check()

    def make(robot: Robot | None, port: int) -> tuple[Command, ...]:
        payload = typed.payload(robot)
        command = complete_command(typed.ids, payload, robot, port, asking.target, generation=generation)
        return (command._replace(options=options),)

    consent = Consent.of(asking.allow, asking.confirm)
    send_commands("send", make, consent, output, connecting, asking, journal)
