"""Measure how strictly a node checks lengths, with documented reads.

A wrong-length probe is harmless only where the firmware rejects the length before it executes. So documented
reads get surplus bytes first: at worst a read is executed. Only a node that rejects them all gets other
probes of a wrong length. Commands that it calls absent are sent again at other lengths.
"""

import asyncio
from collections.abc import Collection
from typing import Final

from sphero_probe.catalogue import all_rows, commands_of
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS, IMPOSSIBLE_DIDS, WRONG_LENGTH
from sphero_probe.probing.profiles import ACCEPTED, GONE, NodeProfile, Strictness
from sphero_probe.probing.questions import Questions, Reply
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.reconnect import Reconnector

_READS_WANTED: Final = 3
_READS_TRIED: Final = 8
_READ_ATTEMPTS: Final = 2
"""How often a silent read is sent before the next read replaces it."""
_OTHER_LENGTHS: Final = (40, 0)


class Calibration:
    """Measures one node, and tells the policy the result."""

    def __init__(self, line: Reconnector, target: int | None, dids: Collection[int] = ()) -> None:
        """Choose the node.

        Args:
            line: to the robot.
            target: the node's address byte.
            dids: devices that will be probed; reads of these come first.
        """
        self._line = line
        self._target = target
        self._dids = dids
        self._questions = Questions(line, target, may_be_mute=True)
        self._absent: Command | None = None
        self._executed: Command | None = None

    async def measure(self) -> NodeProfile:
        """Send the calibration probes and draw the conclusion.

        Raises:
            LinkLostError: the link was lost.
        """
        checks = self._line.link.policy.length_checks
        if checks.is_lenient(self._target):
            return self._conclude(Strictness.LENIENT, "a command accepted a wrong length earlier in this run")
        (reads, verdicts), (device, first) = await asyncio.gather(
            self._reads_that_answer(),
            self._find_absent([Command(did, 0) for did in IMPOSSIBLE_DIDS], *GONE),
        )
        if not reads and verdicts == {Verdict.NO_TARGET}:
            checks.trust(self._target)
            return self._conclude(Strictness.NO_NODE, "every read is answered with bad target id")
        if self._questions.is_mute:
            return self._conclude(Strictness.UNKNOWN, "it answers nothing, not even an echo")
        if not reads:
            return self._conclude(Strictness.UNKNOWN, "no documented read answers on this node")
        command, last = await self._find_absent(
            [Command(reads[0].did, cid) for cid in IMPOSSIBLE_CIDS], Verdict.NO_COMMAND
        )
        if first.verdict in ACCEPTED or last.verdict in ACCEPTED:
            return self._conclude(Strictness.UNKNOWN, "commands that cannot exist succeed")
        surplus = [Command(row.did, row.cid, bytes(WRONG_LENGTH), self._target) for row in reads]
        replies = await self._questions.ask_all(surplus, "bad data length")
        for row, reply in zip(reads, replies, strict=True):
            if reply.verdict in ACCEPTED:
                checks.distrust(self._target)
                return self._conclude(Strictness.LENIENT, f"{row.name} runs with surplus bytes")
            if reply.verdict is not Verdict.BAD_LENGTH:
                return self._conclude(Strictness.UNKNOWN, f"{row.name} does not reject surplus bytes as such")
        checks.trust(self._target)
        for probe in surplus:
            checks.add_rejection(probe)
        absent = [pair for pair in (device, command) if pair]
        lenient, (strictness, why), _ = await asyncio.gather(
            self._setter_without_arguments(), self._other_lengths(*absent), self._codes_on_demand()
        )
        if lenient:
            checks.distrust(self._target)
            return self._conclude(Strictness.LENIENT, lenient)
        if device is None or command is None:
            return self._conclude(*self._without_absent((first if device is None else last).verdict))
        if strictness not in (Strictness.STRICT, Strictness.MASKING):
            checks.suspend(self._target)
        return self._conclude(strictness, why)

    async def _reads_that_answer(self) -> tuple[list[CommandRow], set[Verdict | None]]:
        """Return some reads that succeed, and every verdict seen."""
        robot = self._line.link.policy.robot
        rows = commands_of(robot) if robot else all_rows(self._line.link.codec.generation)
        reads = [
            row
            for row in sorted(rows, key=self._order)
            if row.kind is Kind.COMMAND and row.risk is Risk.READ and row.request and not row.request.text
        ][:_READS_TRIED]
        found: list[CommandRow] = []
        verdicts: set[Verdict | None] = set()
        while reads and len(found) < _READS_WANTED:
            some, reads = reads[: _READS_WANTED - len(found)], reads[_READS_WANTED - len(found) :]
            commands = [Command(row.did, row.cid) for row in some]
            replies = await self._questions.ask_all(commands, "success", attempts=_READ_ATTEMPTS)
            verdicts |= {reply.verdict for reply in replies}
            found += [row for row, reply in zip(some, replies, strict=True) if reply.verdict is Verdict.OK]
        return found, verdicts

    def _order(self, row: CommandRow) -> tuple[bool, bool]:
        """Sort key: reads of the devices to be probed first, then reads whose answer has a fixed length."""
        return row.did not in self._dids, not row.response or not row.response.fixed_length

    async def _setter_without_arguments(self) -> str:
        """Send the LED setter without arguments; return why the node is lenient, empty if it is not."""
        policy = self._line.link.policy
        leds = policy.robot.leds if policy.robot else None
        node = Address.from_byte(self._target or PRIMARY).node
        if leds is None or (leds.node or PRIMARY) != node:
            return ""
        command = Command(leds.did, leds.cid, b"", self._target)
        reply = await self._questions.ask(command, "bad data length")
        if reply.verdict is Verdict.BAD_LENGTH:
            policy.length_checks.add_rejection(command)
        if reply.verdict not in ACCEPTED:
            return ""
        self._executed = command
        return "a setter runs without its arguments"

    async def _codes_on_demand(self) -> None:
        """Ask the robot to answer with each error code, if it can; the answers are evidence."""
        robot = self._line.link.policy.robot
        row = row_for(self._line.link.codec.generation, WellKnown.ERROR_ON_DEMAND)
        if robot is None or row is None or robot.key not in row.nodes:
            return
        codes = range(1, 11)
        commands = [Command(row.did, row.cid, bytes([code])) for code in codes]
        await self._questions.ask_all(commands, *map(self._line.link.codec.code_name, codes))

    async def _other_lengths(self, *pairs: Command) -> tuple[Strictness, str]:
        """Send commands that were called absent at other lengths."""
        commands = [pair._replace(payload=bytes(length)) for pair in pairs for length in _OTHER_LENGTHS]
        for command, reply in zip(commands, await self._questions.ask_all(commands, "absent"), strict=True):
            if reply.verdict is Verdict.BAD_LENGTH:
                why = f"{len(command.payload)} bytes are rejected even where no command exists"
                return Strictness.MASKING, why
            if reply.verdict not in GONE:
                why = f"an absent command answers {len(command.payload)} bytes differently"
                return Strictness.UNKNOWN, why
        return Strictness.STRICT, "surplus bytes are rejected, and only where a command exists"

    @staticmethod
    def _without_absent(verdict: Verdict | None) -> tuple[Strictness, str]:
        """Draw the conclusion on a node that calls nothing absent."""
        if verdict is None:
            return Strictness.MASKING, "commands that cannot exist are not answered"
        if verdict is Verdict.BAD_LENGTH:
            return Strictness.MASKING, "a wrong length is rejected even where no command exists"
        return Strictness.MASKING, f"commands that cannot exist are answered: {verdict.value}"

    async def _find_absent(self, candidates: list[Command], *wanted: Verdict) -> tuple[Command | None, Reply]:
        """Return the first candidate that the node calls absent, and the last reply.

        The policy then allows any length for a command that was called absent.
        """
        reply = Reply(None)
        for candidate in candidates:
            probe = candidate._replace(payload=bytes(WRONG_LENGTH))
            reply = await self._questions.ask(probe, wanted[0].value)
            if reply.verdict in wanted:
                absent = candidate._replace(target=self._target)
                self._line.link.policy.length_checks.mark_absent(absent)
                self._absent = absent
                return absent, reply
        return None, reply

    def _conclude(self, strictness: Strictness, why: str) -> NodeProfile:
        steps = tuple(self._questions.steps)
        return NodeProfile(
            self._target, strictness, why, steps, self._absent, self._executed, self._questions.is_mute
        )
