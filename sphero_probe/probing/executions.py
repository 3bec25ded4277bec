"""Detect and report commands that accepted a wrong length: they were executed instead of rejected."""

from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime

from sphero_probe.catalogue import MOVING_DEVICES, lookup
from sphero_probe.errors import LinkLostError
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.finding import Note
from sphero_probe.probing.notes import executed_note
from sphero_probe.probing.oneshot import stop_motors
from sphero_probe.probing.prober import Prober
from sphero_probe.probing.profiles import ACCEPTED, Answer
from sphero_probe.protocol.packets import Command, Verdict


class Executions:
    """Checks the answers to wrong lengths; the first one that is accepted makes its node lenient.

    Attributes:
        numbers: of the probes that were executed.
        commands: that were executed, also during calibration.
    """

    def __init__(self, prober: Prober, on_note: Callable[[Note], None]) -> None:
        self.numbers: set[int] = set()
        self.commands: list[Command] = []
        self._prober = prober
        self._on_note = on_note
        self._unreported: list[Command] = []
        self._must_stop = False

    def learn(self, probe: PreparedProbe, answer: Answered) -> None:
        """Check an answer to a probe; if it accepted a wrong length, block others to that node."""
        if not probe.is_wrong_length:
            return
        command, codec = probe.command, self._prober.link.codec
        device = self._prober.devices.get((command.target, command.did))
        length = len(command.payload)
        if device and device.knows_impossible:
            said = Answer(answer.response.code, answer.response.payload)
            if device.to_impossible(length) == said:
                return  # commands that cannot exist get the same answer
        checks = self._prober.link.policy.length_checks
        verdict = codec.verdict(answer.response.code)
        if verdict is Verdict.BAD_LENGTH:
            checks.add_rejection(command)
        elif verdict in ACCEPTED:
            checks.distrust(command.target)
            self.numbers.add(probe.number)
            self._unreported.append(command)

    async def report(self) -> None:
        """Report commands executed since the last call, and stop the motors if one may move the robot.

        If the link is lost, the next call tries to stop the motors again.
        """
        unreported, self._unreported = self._unreported, []
        for command in unreported:
            self.take(command)
        if self._must_stop:
            with suppress(LinkLostError):
                await stop_motors(self._prober.link, self._prober.target, always=True)
                self._must_stop = False

    def take(self, command: Command) -> None:
        """Record and report that a command accepted a wrong length and was executed."""
        self.commands.append(command)
        link = self._prober.link
        row = lookup(link.codec.generation, command.did, command.cid, link.policy.robot)
        self._on_note(executed_note(command, row.name if row else "", datetime.now(UTC)))
        self._must_stop |= command.did in MOVING_DEVICES[link.codec.generation]
