"""Measure how strictly a node checks lengths, with documented reads.

A wrong-length probe is harmless only where the firmware rejects the length before it executes. So documented
reads get surplus bytes first: at worst a read is executed. Only a node that rejects them all gets other
probes of a wrong length. Commands that it calls absent are sent again at other lengths.
"""

import asyncio
from collections.abc import Awaitable, Callable, Collection
from typing import Final

from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.wrong_lengths import IMPOSSIBLE_CIDS, IMPOSSIBLE_DIDS, WRONG_PAYLOAD
from sphero_probe.probing.calibration_rows import reads_to_try
from sphero_probe.probing.profiles import ACCEPTED, GONE, NodeProfile, Strictness
from sphero_probe.probing.questions import Questions, Reply
from sphero_probe.probing.retries import LossEstimate
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Command, Verdict
from sphero_probe.session.reconnect import Reconnector

_READS_WANTED: Final = 3
_READ_ATTEMPTS: Final = 2
"""How often a silent read is sent before the next read replaces it."""
_OTHER_LENGTHS: Final = (40, 0)
_PAIRS_WANTED: Final = 2
"""An absent device, and an absent command of a device that is there."""


class Calibration:
    """Measures one node, and tells the policy the result.

    Attributes:
        impossible: commands that cannot exist and were answered -> the reply.
    """

    def __init__(
        self,
        line: Reconnector,
        target: int | None,
        loss: LossEstimate,
        dids: Collection[int] = (),
        turn: asyncio.Lock | None = None,
    ) -> None:
        """Choose the node.

        Args:
            line: to the robot.
            target: the node's address byte.
            loss: learns how much the link loses.
            dids: devices that will be probed; reads of these come first.
            turn: as in ``Questions``.
        """
        self._line = line
        self._target = target
        self._dids = dids
        self._questions = Questions(line, target, loss, may_be_mute=True, turn=turn)
        self.impossible: dict[Command, Reply] = {}
        self._absent: Command | None = None
        self._executed: Command | None = None
        self._pairs: list[Command] = []
        self._masked: Verdict | None = None
        self._strictness, self._why = Strictness.UNKNOWN, ""
        self._is_trusted = self._has_codes = False
        self._has_tried_absent = asyncio.Event()

    async def measure(self, meanwhile: Callable[[], Awaitable[object]]) -> bool:
        """Send reads, reads with surplus bytes, and commands that cannot exist; return whether it is trusted.

        A trusted node rejects the surplus bytes of every read; ``ask_setter`` and ``finish`` must follow.

        Args:
            meanwhile: asks more than this, once a read and the first command that cannot exist were answered.

        Raises:
            LinkLostError: the link was lost.
        """
        checks = self._line.link.policy.length_checks
        if checks.is_lenient(self._target):
            self._conclude(Strictness.LENIENT, "a command accepted a wrong length earlier in this run")
            return False
        codec, robot = self._line.link.codec, self._line.link.policy.robot
        candidates = reads_to_try(codec.generation, robot, self._dids)
        first_tried = [Command(row.did, IMPOSSIBLE_CIDS[0]) for row in candidates[:1]]
        (reads, replies, verdicts), (command, last), (device, first) = await asyncio.gather(
            self._ask_reads(candidates, meanwhile),
            self._try_absent(first_tried),
            self._find_absent([Command(did, 0) for did in IMPOSSIBLE_DIDS], *GONE),
        )
        if command is None and reads:
            wanted = [Command(reads[0].did, cid) for cid in IMPOSSIBLE_CIDS]
            untried = wanted if last.verdict is None else [one for one in wanted if one not in first_tried]
            command, last = await self._find_absent(untried, Verdict.NO_COMMAND)
        if not reads and verdicts == {Verdict.NO_TARGET}:
            checks.trust(self._target)
            self._conclude(Strictness.NO_NODE, "every read is answered with bad target id")
        elif self._questions.is_mute:
            self._conclude(Strictness.UNKNOWN, "it answers nothing, not even an echo")
        elif not reads:
            self._conclude(Strictness.UNKNOWN, "no documented read answers on this node")
        elif first.verdict in ACCEPTED or last.verdict in ACCEPTED:
            self._conclude(Strictness.UNKNOWN, "commands that cannot exist succeed")
        elif self._all_rejected(reads, replies):
            checks.trust(self._target)
            self._pairs = [pair for pair in (device, command) if pair]
            if device is None or command is None:
                self._masked = (first if device is None else last).verdict
            self._is_trusted = True
            self._conclude(Strictness.UNKNOWN, "its measurement was not finished")
        return self._is_trusted

    async def finish(self) -> None:
        """Send absent commands at other lengths to a trusted node, once, and draw the conclusion.

        Raises:
            LinkLostError: the link was lost.
        """
        if not self._is_trusted:
            return
        strictness, why = await self._other_lengths(*self._pairs)
        self._is_trusted = False
        if len(self._pairs) < _PAIRS_WANTED:
            strictness, why = self._without_absent(self._masked)
        if strictness not in (Strictness.STRICT, Strictness.MASKING):
            self._line.link.policy.length_checks.suspend(self._target)
        self._conclude(strictness, why)

    def profile(self) -> NodeProfile:
        """Return what was measured."""
        return NodeProfile(
            self._target,
            self._strictness,
            self._why,
            tuple(self._questions.steps),
            self._absent,
            self._executed,
            self._questions.is_mute,
        )

    async def ask_codes(self) -> None:
        """Ask the robot to answer with each error code, once and if it can; the answers are evidence.

        Raises:
            LinkLostError: the link was lost.
        """
        robot = self._line.link.policy.robot
        row = row_for(self._line.link.codec.generation, WellKnown.ERROR_ON_DEMAND)
        if robot is None or row is None or robot.key not in row.nodes or not self._pairs:
            return
        if self._has_codes:
            return
        self._has_codes = True
        codes = range(1, 11)
        commands = [Command(row.did, row.cid, bytes([code])) for code in codes]
        await self._questions.ask_all(commands, *map(self._line.link.codec.code_name, codes))

    async def _ask_reads(
        self, candidates: list[CommandRow], meanwhile: Callable[[], Awaitable[object]]
    ) -> tuple[list[CommandRow], list[Reply], set[Verdict | None]]:
        """Return reads that succeed, how each answers surplus bytes, and every verdict of a read."""
        reads, verdicts = await self._reads_that_answer(candidates)
        if not reads:
            return [], [], verdicts
        surplus = [Command(row.did, row.cid, WRONG_PAYLOAD, self._target) for row in reads]
        replies, _ = await asyncio.gather(
            self._questions.ask_all(surplus, "bad data length"), self._after_absent(meanwhile)
        )
        return reads, replies, verdicts

    async def _try_absent(self, candidates: list[Command]) -> tuple[Command | None, Reply]:
        """Send commands that cannot exist once each."""
        try:
            return await self._find_absent(candidates, Verdict.NO_COMMAND, attempts=1)
        finally:
            self._has_tried_absent.set()

    async def _after_absent(self, meanwhile: Callable[[], Awaitable[object]]) -> None:
        """Ask more once the first command that cannot exist was tried: its answer is not asked for twice."""
        await self._has_tried_absent.wait()
        await meanwhile()

    def _all_rejected(self, reads: list[CommandRow], replies: list[Reply]) -> bool:
        """Whether every read rejects surplus bytes; if one does not, that is the conclusion."""
        checks = self._line.link.policy.length_checks
        for row, reply in zip(reads, replies, strict=True):
            if reply.verdict in ACCEPTED:
                checks.distrust(self._target)
                self._conclude(Strictness.LENIENT, f"{row.name} runs with surplus bytes")
                return False
            if reply.verdict is not Verdict.BAD_LENGTH:
                self._conclude(Strictness.UNKNOWN, f"{row.name} does not reject surplus bytes as such")
                return False
        for row in reads:
            checks.add_rejection(Command(row.did, row.cid, target=self._target))
        return True

    async def _reads_that_answer(
        self, reads: list[CommandRow]
    ) -> tuple[list[CommandRow], set[Verdict | None]]:
        """Return some reads that succeed, and every verdict seen."""
        found: list[CommandRow] = []
        verdicts: set[Verdict | None] = set()
        while reads and len(found) < _READS_WANTED:
            some, reads = reads[: _READS_WANTED - len(found)], reads[_READS_WANTED - len(found) :]
            commands = [Command(row.did, row.cid) for row in some]
            replies = await self._questions.ask_all(commands, "success", attempts=_READ_ATTEMPTS)
            verdicts |= {reply.verdict for reply in replies}
            found += [row for row, reply in zip(some, replies, strict=True) if reply.verdict is Verdict.OK]
        return found, verdicts

    async def ask_setter(self) -> None:
        """Send the LED setter without its arguments to a trusted node; if it accepts that, it is lenient.

        Raises:
            LinkLostError: the link was lost.
        """
        policy = self._line.link.policy
        leds = policy.robot.leds if policy.robot else None
        node = Address.from_byte(self._target or PRIMARY).node
        if leds is None or (leds.node or PRIMARY) != node:
            return
        command = Command(leds.did, leds.cid, b"", self._target)
        reply = await self._questions.ask(command, "bad data length")
        if reply.verdict is Verdict.BAD_LENGTH:
            policy.length_checks.add_rejection(command)
        elif reply.verdict in ACCEPTED:
            self._executed = command
            self._is_trusted = False
            policy.length_checks.distrust(self._target)
            self._conclude(Strictness.LENIENT, "a setter runs without its arguments")

    async def _other_lengths(self, *pairs: Command) -> tuple[Strictness, str]:
        """Send commands that were called absent at other lengths, as far as the policy lets them."""
        long, empty = ([pair._replace(payload=bytes(length)) for pair in pairs] for length in _OTHER_LENGTHS)
        replies, more = await asyncio.gather(
            self._ask_in_turn(long), self._questions.ask_all(empty, "absent")
        )
        asked = [*zip(long, replies, strict=True), *zip(empty, more, strict=True)]
        for command, reply in asked:
            self._keep(command, reply)
        for command, reply in asked:
            if reply.blocked:
                continue
            if reply.verdict is Verdict.BAD_LENGTH:
                why = f"{len(command.payload)} bytes are rejected even where no command exists"
                return Strictness.MASKING, why
            if reply.verdict not in GONE:
                why = f"an absent command answers {len(command.payload)} bytes differently"
                return Strictness.UNKNOWN, why
        return Strictness.STRICT, "surplus bytes are rejected, and only where a command exists"

    async def _ask_in_turn(self, commands: list[Command]) -> list[Reply]:
        """Send long commands one after the other: each takes several packets, and delays what follows."""
        return [await self._questions.ask(command, "absent") for command in commands]

    @staticmethod
    def _without_absent(verdict: Verdict | None) -> tuple[Strictness, str]:
        """Draw the conclusion on a node that calls nothing absent."""
        if verdict is None:
            return Strictness.MASKING, "commands that cannot exist are not answered"
        if verdict is Verdict.BAD_LENGTH:
            return Strictness.MASKING, "a wrong length is rejected even where no command exists"
        return Strictness.MASKING, f"commands that cannot exist are answered: {verdict.value}"

    async def _find_absent(
        self, candidates: list[Command], *wanted: Verdict, attempts: int | None = None
    ) -> tuple[Command | None, Reply]:
        """Return the first candidate that the node calls absent, and the last reply.

        The policy then allows any length for a command that was called absent.
        """
        reply = Reply(None)
        for candidate in candidates:
            probe = candidate._replace(payload=WRONG_PAYLOAD)
            (reply,) = await self._questions.ask_all([probe], wanted[0].value, attempts=attempts)
            self._keep(probe, reply)
            if reply.verdict in wanted:
                absent = candidate._replace(target=self._target)
                self._line.link.policy.length_checks.mark_absent(absent)
                self._absent = absent
                return absent, reply
        return None, reply

    def _keep(self, command: Command, reply: Reply) -> None:
        if reply.verdict is not None:
            self.impossible[command._replace(target=self._target)] = reply

    def _conclude(self, strictness: Strictness, why: str) -> None:
        self._strictness, self._why = strictness, why
