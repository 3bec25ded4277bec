"""How strictly a node checks lengths, measured: a link and a node in, a strictness profile out.

A wrong-length probe is harmless only where the firmware refuses the length before it executes. So documented
reads are asked with surplus bytes first: at worst a read runs. Only a node that refused them all is asked
about pairs that cannot exist, and only what it called absent is asked again at other lengths.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.catalogue import all_rows, commands_of
from sphero_probe.catalogue.model import CommandRow, Kind
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.concurrent import ask_together
from sphero_probe.link.exchange import Answered
from sphero_probe.link.link import Link
from sphero_probe.link.pacing import MAX_ATTEMPTS
from sphero_probe.link.policy import WRONG_LENGTH
from sphero_probe.protocol.address import PRIMARY, Address
from sphero_probe.protocol.packets import Command, Verdict

_READS_WANTED: Final = 3
_READS_TRIED: Final = 8
_ABSENT_DEVICES: Final = (0xEE, 0xED, 0xEC)
"""Device ids far from any that a robot is known to have."""
ABSENT_COMMANDS: Final = (0xFD, 0xFC, 0xFB)
"""Command ids far from any that a device is known to have."""
_LENGTHS: Final = (WRONG_LENGTH, 40, 0)
GONE: Final = (Verdict.NO_DEVICE, Verdict.NO_COMMAND)
"""What a robot says of a pair that it does not have."""


class Strictness(StrEnum):
    """How a node treats a length that a command does not take."""

    STRICT = "strict"
    """Refused with "bad length", only where the command exists."""
    MASKING = "masking"
    """Refused with "bad length" even where no command exists: existence is only "maybe"."""
    LENIENT = "lenient"
    """Surplus bytes are ignored and the command runs: wrong-length probing is off."""
    NO_NODE = "no such node"
    """Every read is answered with "bad target id": nothing is there that could execute anything."""
    UNKNOWN = "unknown"
    """It could not be measured: wrong-length probing is off."""


class Step(NamedTuple):
    """One calibration probe and what came of it.

    Attributes:
        command: what was asked.
        wanted: what a strict node says.
        said: what this node said, in words.
    """

    command: Command
    wanted: str
    said: str


class Profile(NamedTuple):
    """What calibration found on one node.

    Attributes:
        target: the node's address byte, None where addresses are left out.
        strictness: the conclusion.
        why: one line.
        steps: the evidence.
        absent: a pair that the node called absent, None where it called none so.
    """

    target: int | None
    strictness: Strictness
    why: str
    steps: tuple[Step, ...]
    absent: Command | None = None


class Calibration:
    """Measures one node over a link; the guard learns what was measured."""

    def __init__(self, link: Link, target: int | None) -> None:
        self._link = link
        self._target = target
        self._steps: list[Step] = []
        self._absent: Command | None = None
        self._last: Verdict | None = None
        self._verdicts: set[Verdict | None] = set()

    async def measure(self) -> Profile:
        """Ask the calibration probes and conclude.

        Raises:
            LinkLostError: the robot is gone.
        """
        policy = self._link.policy
        reads = await self._reads_that_answer()
        if not reads and self._verdicts == {Verdict.NO_TARGET}:
            policy.trust_length_check(self._target)
            return self._conclude(Strictness.NO_NODE, "every read is answered with bad target id")
        if not reads:
            return self._conclude(Strictness.UNKNOWN, "no documented read answers on this node")
        surplus = [Command(row.did, row.cid, bytes(WRONG_LENGTH)) for row in reads]
        for row, said in zip(reads, await self._ask_all(surplus, "bad data length"), strict=True):
            if said is Verdict.OK:
                return self._conclude(Strictness.LENIENT, f"{row.name} runs with surplus bytes")
            if said is not Verdict.BAD_LENGTH:
                return self._conclude(
                    Strictness.UNKNOWN, f"{row.name} with surplus bytes is not refused as such"
                )
        policy.trust_length_check(self._target)
        if why := await self._setter_without_arguments():
            policy.distrust_length_check(self._target)
            return self._conclude(Strictness.LENIENT, why)
        await self._codes_on_demand()
        strictness, why = await self._absent_pairs(reads[0].did)
        if strictness not in (Strictness.STRICT, Strictness.MASKING):
            policy.distrust_length_check(self._target)
        return self._conclude(strictness, why)

    async def _reads_that_answer(self) -> list[CommandRow]:
        robot = self._link.policy.robot
        rows = commands_of(robot) if robot else all_rows(self._link.codec.generation)
        reads = [
            row
            for row in sorted(rows, key=lambda row: not row.response or not row.response.fixed_length)
            if row.kind is Kind.COMMAND and row.risk is Risk.READ and row.request and not row.request.text
        ][:_READS_TRIED]
        found: list[CommandRow] = []
        while reads and len(found) < _READS_WANTED:
            some, reads = reads[: _READS_WANTED - len(found)], reads[_READS_WANTED - len(found) :]
            said = await self._ask_all([Command(row.did, row.cid) for row in some], "success")
            found += [row for row, verdict in zip(some, said, strict=True) if verdict is Verdict.OK]
        return found

    async def _setter_without_arguments(self) -> str:
        """Ask the lamps' setter without arguments; return why that speaks against the node, or nothing."""
        robot = self._link.policy.robot
        node = Address.from_byte(self._target or PRIMARY).node
        if robot is None or robot.leds is None or (robot.leds.node or PRIMARY) != node:
            return ""
        said = await self._ask(Command(robot.leds.did, robot.leds.cid), "bad data length")
        return "a setter runs without its arguments" if said is Verdict.OK else ""

    async def _codes_on_demand(self) -> None:
        """Have the robot answer with each code where it can; what it says is evidence, and shown."""
        robot = self._link.policy.robot
        row = row_for(self._link.codec.generation, WellKnown.ERROR_ON_DEMAND)
        if robot is None or row is None or robot.key not in row.nodes:
            return
        codes = range(1, 11)
        commands = [Command(row.did, row.cid, bytes([code])) for code in codes]
        await self._ask_all(commands, *map(self._link.codec.code_name, codes))

    async def _absent_pairs(self, did: int) -> tuple[Strictness, str]:
        device = await self._find_absent([Command(did, 0) for did in _ABSENT_DEVICES], Verdict.NO_DEVICE)
        command = await self._find_absent([Command(did, cid) for cid in ABSENT_COMMANDS], Verdict.NO_COMMAND)
        if device is None:
            return Strictness.UNKNOWN, "no device id is called bad"
        if command is None:
            if self._last is Verdict.BAD_LENGTH:
                return Strictness.MASKING, "a wrong length is refused even where no command exists"
            return Strictness.UNKNOWN, "no command id is called bad"
        commands = [
            pair._replace(payload=bytes(length)) for pair in (device, command) for length in _LENGTHS[1:]
        ]
        for asked, said in zip(commands, await self._ask_all(commands, "absent"), strict=True):
            if said is Verdict.BAD_LENGTH:
                why = f"{len(asked.payload)} bytes are refused even where no command exists"
                return Strictness.MASKING, why
            if said not in GONE:
                why = f"an absent command answers {len(asked.payload)} bytes differently"
                return Strictness.UNKNOWN, why
        return Strictness.STRICT, "surplus bytes are refused, and only where a command exists"

    async def _find_absent(self, candidates: list[Command], wanted: Verdict) -> Command | None:
        """Return the first candidate that the node calls absent; the guard may then let any length to it."""
        for candidate in candidates:
            if await self._ask(candidate._replace(payload=bytes(WRONG_LENGTH)), wanted.value) is wanted:
                absent = candidate._replace(target=self._target)
                self._link.policy.take_as_absent(absent)
                self._absent = absent
                return absent
        return None

    async def _ask(self, command: Command, wanted: str) -> Verdict | None:
        """Ask one; None when nothing answers or the guard withholds it."""
        (verdict,) = await self._ask_all([command], wanted)
        return verdict

    async def _ask_all(self, commands: Sequence[Command], *wanted: str) -> list[Verdict | None]:
        """Ask several at once; what is wanted is told for each, or once for all."""
        wanted = wanted if len(wanted) == len(commands) else wanted * len(commands)
        tried = await ask_together(map(self._try, commands, wanted))
        self._steps += [step for step, _ in tried]
        verdicts = [verdict for _, verdict in tried]
        self._verdicts.update(verdicts)
        self._last = verdicts[-1]
        return verdicts

    async def _try(self, command: Command, wanted: str) -> tuple[Step, Verdict | None]:
        """Ask up to three times, but for the first alone."""
        codec = self._link.codec
        command = command._replace(target=self._target)
        for attempt in range(MAX_ATTEMPTS):
            exchange = await self._link.ask(command, alone=attempt > 0, expected=True)
            if isinstance(exchange, Answered):
                verdict = codec.verdict(exchange.response.code)
                said = codec.code_name(exchange.response.code)
                if verdict is not Verdict.BUSY or wanted == said:
                    return Step(command, wanted, said), verdict
        return Step(command, wanted, "no answer"), None

    def _conclude(self, strictness: Strictness, why: str) -> Profile:
        return Profile(self._target, strictness, why, tuple(self._steps), self._absent)
