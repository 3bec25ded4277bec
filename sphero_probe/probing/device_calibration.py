"""Measure how strictly one device of a node checks lengths, and how it answers commands that cannot exist.

Each command handler of a firmware checks lengths by itself, so a node's reads say little about the setters of
another device. Every documented read of the device gets surplus bytes. So do up to two setters that change
nothing if they are executed: those that switch off a notification.
"""

import asyncio
from collections import Counter
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS, WRONG_LENGTH, WRONG_PAYLOAD
from sphero_probe.probing.calibration_rows import calibration_rows
from sphero_probe.probing.profiles import ACCEPTED, GONE, Answer, DeviceProfile
from sphero_probe.probing.questions import Questions, Reply
from sphero_probe.probing.retries import LossEstimate
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.identify import ask_well_known
from sphero_probe.session.reconnect import Reconnector

_TRIES: Final = 2
"""How often a silent command is sent, also over dropped links: it may be the cause of the drop."""
_NOTHING: Final[Mapping[Command, Reply]] = MappingProxyType({})


class DeviceCalibration:
    """Measures one device of a node, reads first, and tells the policy the result.

    Each question is asked once: after a lost link, ``ask_reads`` and ``ask_setters`` continue with the
    others.

    Attributes:
        has_reads: every read was asked.
    """

    def __init__(
        self,
        line: Reconnector,
        loss: LossEstimate,
        target: int | None,
        did: int,
        turn: asyncio.Lock | None = None,
    ) -> None:
        """Choose the device; ``turn`` is as in ``Questions``."""
        self.has_reads = False
        self._line = line
        self._target = target
        self._did = did
        self._questions = Questions(line, target, loss, _TRIES, turn=turn)
        self._impossible: dict[int, Answer | None] = {}
        self._executed: Command | None = None
        self._asked = self._rejected = 0
        self._wrong: Reply | None = None
        self._absent: Command | None = None
        self._knows_impossible = False
        self._done: set[int] = set()
        self._tries: Counter[int] = Counter()
        self._claimed: frozenset[int] = frozenset()
        self._has_claims = False

    async def ask_impossible(self, known: Mapping[Command, Reply] = _NOTHING) -> None:
        """Send a command that cannot exist.

        Args:
            known: commands that its node already answered -> the reply.

        Raises:
            LinkLostError: the link was lost.
        """
        if not self._knows_impossible:
            await self._ask_impossible(known)
            self._knows_impossible = True

    async def ask_reads(self) -> None:
        """Send a command that cannot exist, and reads with surplus bytes.

        Raises:
            LinkLostError: the link was lost.
        """
        await self.ask_impossible()
        if self._may_go_on():
            reads, _ = self._rows()
            await ask_together(map(self._ask_read, reads))
            self.has_reads = True

    async def ask_empty(self, known: Mapping[Command, Reply] = _NOTHING) -> None:
        """Send the command that cannot exist without payload, if it was called absent.

        An empty payload would run a command that exists after all. Where documented empty commands erase, the
        policy blocks it even then.

        Args:
            known: as above.

        Raises:
            LinkLostError: the link was lost.
        """
        if self._absent and 0 not in self._impossible:
            reply = known.get(self._absent) or await self._questions.ask(
                self._absent, Verdict.NO_COMMAND.value
            )
            self._keep(0, reply)

    async def ask_setters(self) -> None:
        """Send harmless setters with a wrong length, one after the other, until one accepts it.

        Raises:
            LinkLostError: the link was lost.
        """
        _, setters = self._rows()
        for row in setters:
            if not self._may_go_on() or self._masks:
                return
            if self._is_done(row):
                continue
            probe = Command(self._did, row.cid, WRONG_PAYLOAD, self._target)
            reply = await self._questions.ask(probe, "bad data length")
            self._learn(probe, reply)
            self._done.add(row.cid)
            if reply.verdict in ACCEPTED:
                self._executed = probe

    def profile(self) -> DeviceProfile:
        """Return what was measured."""
        return DeviceProfile(
            self._target,
            self._did,
            self._exists,
            self._asked,
            self._rejected,
            self._impossible,
            tuple(self._questions.steps),
            self._executed,
            self._claimed,
        )

    @property
    def _exists(self) -> bool:
        """Whether the device may exist."""
        return self._wrong is None or self._wrong.verdict is not Verdict.NO_DEVICE

    @property
    def _masks(self) -> bool:
        """Whether commands that cannot exist reject the wrong length."""
        return self._wrong is not None and self._wrong.verdict is Verdict.BAD_LENGTH

    def _is_done(self, row: CommandRow) -> bool:
        """Whether a command was answered, or was in flight twice when the link dropped."""
        self._tries[row.cid] += 1
        return row.cid in self._done or self._tries[row.cid] > _TRIES

    def _may_go_on(self) -> bool:
        checks = self._line.link.policy.length_checks
        return (
            self._exists
            and checks.is_strict(self._target)
            and not checks.is_uninformative(self._target, self._did)
        )

    def _rows(self) -> tuple[list[CommandRow], list[CommandRow]]:
        return calibration_rows(self._line.link.codec.generation, self._line.link.policy.robot, self._did)

    async def _ask_impossible(self, known: Mapping[Command, Reply]) -> None:
        """Send a command that cannot exist.

        If it is silent, a second such command is sent; if that is silent, too, silence is the answer.
        """
        first, second, third = (Command(self._did, cid, b"", self._target) for cid in IMPOSSIBLE_CIDS)
        for command in (first, second):
            if self._wrong is None or (self._wrong.verdict is None and not self._wrong.blocked):
                await self._ask_one_impossible(command, known)
        if self._wrong and self._wrong.verdict in ACCEPTED:
            other = await self._questions.ask(third._replace(payload=WRONG_PAYLOAD), Verdict.NO_COMMAND.value)
            self._judge_yes(first, other)

    async def _ask_one_impossible(self, command: Command, known: Mapping[Command, Reply]) -> None:
        """Send one command at the wrong length; its reply is kept even if the link is lost right after it.

        The echo that is sent along keeps the loss of long answers apart from a full queue.
        """
        probe = command._replace(payload=WRONG_PAYLOAD)
        if probe in known:
            self._learn_impossible(command, known[probe])
            return
        echo = ask_well_known(self._line.link, WellKnown.ECHO, self._target, attempts=1)
        await asyncio.gather(self._ask_wrong_length(command, probe), echo)

    async def _ask_wrong_length(self, command: Command, probe: Command) -> None:
        self._learn_impossible(command, await self._questions.ask(probe, Verdict.NO_COMMAND.value))

    def _learn_impossible(self, command: Command, reply: Reply) -> None:
        self._wrong = reply
        self._absent = None
        if reply.verdict in GONE:
            self._absent = command
            self._line.link.policy.length_checks.mark_absent(command)
        self._keep(WRONG_LENGTH, reply)

    def _keep(self, length: int, reply: Reply) -> None:
        """Keep what a command that cannot exist answers at a length."""
        if not reply.blocked:
            self._impossible[length] = reply.answer

    def _judge_yes(self, command: Command, other: Reply) -> None:
        """Record that a command that cannot exist succeeded.

        Either the device accepts every command, or this one exists and was executed.
        """
        checks = self._line.link.policy.length_checks
        if other.verdict in ACCEPTED:
            checks.mark_uninformative(self._target, self._did)
        else:
            self._executed = command._replace(payload=WRONG_PAYLOAD)
            self._impossible[WRONG_LENGTH] = other.answer
            checks.distrust(self._target)

    async def _ask_read(self, row: CommandRow) -> None:
        """Send a read with surplus bytes, unless that was done, here or when its node was measured."""
        if self._is_done(row):
            return
        probe = Command(self._did, row.cid, WRONG_PAYLOAD, self._target)
        if row.cid in self._line.link.policy.length_checks.rejections(self._target, self._did):
            self._asked += 1
            self._rejected += 1
        else:
            reply = await self._questions.ask(probe, "bad data length")
            if await self._takes_part(row, reply):
                self._learn(probe, reply)
        self._done.add(row.cid)

    async def _takes_part(self, row: CommandRow, reply: Reply) -> bool:
        """Whether an existing command answered; a masking device rejects wrong lengths of any command."""
        if reply.verdict is not Verdict.BAD_LENGTH or not self._masks:
            return True
        sample = row.sample if row.sample is not None else row.request.zeros() if row.request else b""
        proper = await self._questions.ask(Command(self._did, row.cid, sample), "success")
        return proper.verdict is Verdict.OK

    async def ask_claims(self) -> None:
        """Read the robot's own list of this device's commands: a wrong length may reach those.

        Raises:
            LinkLostError: the link was lost.
        """
        robot = self._line.link.policy.robot
        row = row_for(self._line.link.codec.generation, WellKnown.CLAIMED_COMMANDS)
        if robot is None or row is None or robot.key not in row.nodes or self._has_claims:
            return
        if not self._may_go_on():
            return
        reply = await self._questions.ask(Command(row.did, row.cid, bytes([self._did])), "success")
        if reply.verdict is Verdict.OK and reply.answer:
            self._claimed = frozenset(reply.answer.payload)
        self._has_claims = True

    def _learn(self, probe: Command, reply: Reply) -> None:
        checks = self._line.link.policy.length_checks
        if reply.verdict is Verdict.BAD_LENGTH:
            self._asked += 1
            self._rejected += 1
            checks.add_rejection(probe)
        elif reply.verdict in ACCEPTED:
            self._asked += 1
            checks.distrust(self._target)
