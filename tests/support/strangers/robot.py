"""A robot that executes a table of commands and records what it did. Standard library only."""

from collections import Counter
from dataclasses import dataclass, field
from random import Random
from typing import NamedTuple

from tests.support.strangers.commands import Effect, Row
from tests.support.strangers.firmware import OLDER, Check, Code, Firmware, Moment, Nothing, Voice, Word
from tests.support.strangers.frames import Answer, EarV1, EarV2, Request, answer_v1, answer_v2


class Executed(NamedTuple):
    """One line of the ledger: what ran, when, and when the host had the answer."""

    at: float
    known_at: float
    row: Row
    data: bytes

    @property
    def unallowed(self) -> bool:
        """Whether it changed something, which a run without further consent must not do."""
        return self.row.effect > Effect.READ and not (self.row.idle and not any(self.data))


class Heard(NamedTuple):
    """A request and its result; ``said`` is the code that was sent, None for silence."""

    at: float
    node: int
    did: int
    cid: int
    data: bytes
    said: int | None


class Said(NamedTuple):
    """Bytes on their way to the host, seconds from now."""

    delay: float
    data: bytes


@dataclass
class Robot:
    """One robot, its truth and its ledger.

    Attributes:
        ledger: what was executed.
        heard: every request, in order.
        asleep: it says nothing until it is woken.
        woken_at: when it was last woken through node 1.
        dropped: it dropped the line and waits for another.
    """

    firmware: Firmware
    voice: Voice
    ledger: list[Executed] = field(default_factory=list)
    heard: list[Heard] = field(default_factory=list)
    asleep: bool = False
    woken_at: float = 0.0
    dropped: bool = False
    chance: Random = field(default_factory=lambda: Random(7))
    _attempts: Counter[tuple[int, int, int, bytes]] = field(default_factory=Counter)
    _free_at: float = 0.0
    _boots_until: float = 0.0

    def __post_init__(self) -> None:
        self._rows = {row.triple: row for row in self.firmware.rows}
        self._nodes = {row.node for row in self.firmware.rows}
        self._devices = {(row.node, row.did) for row in self.firmware.rows}
        self.connect(0.0)

    def connect(self, now: float) -> None:
        """Use another line in place of the current one."""
        self._ear: EarV1 | EarV2 = EarV1() if self.firmware.older else EarV2()
        if self.dropped:
            self._boots_until = now + 1.0
        self.dropped = False

    @property
    def truth(self) -> set[tuple[int, int, int]]:
        """Node, DID and CID of every command that exists."""
        return set(self._rows)

    def hear(self, data: bytes, now: float) -> list[Said]:
        """Receive bytes from the host and return the responses."""
        said: list[Said] = []
        for request in self._ear.feed(data):
            if not self.dropped and now >= self._boots_until:
                said += self._serve(request, now)
        return said

    def _serve(self, request: Request, now: float) -> list[Said]:
        node = (request.tid or 1) & 0x0F or 1
        key = node, request.did, request.cid, request.data
        self._attempts[key] += 1
        moment = Moment(self, request, node, now, len(self.heard) + 1, self._attempts[key])
        if (self._free_at - now) > self.voice.queue * self.voice.service:
            return self._remember(moment, None, b"")
        self._free_at = max(now, self._free_at) + self.voice.service
        if self.voice.drops(moment):
            self.dropped = True
            return self._remember(moment, None, b"")
        delay = self._free_at - now + self.voice.latency + self.voice.late(moment)
        word, data = self._answer(moment, now + delay)
        if not isinstance(word, Code):
            return self._remember(moment, None, b"")
        return self._remember(moment, word, data, delay)

    def _remember(self, moment: Moment, code: Code | None, data: bytes, delay: float = 0.0) -> list[Said]:
        """Record a request and its response, and return the bytes of the response as they will arrive."""
        request, node = moment.request, moment.node
        frame = b"" if code is None or not request.flags & 0x02 else self._frame(moment, code, data)
        said = int(code) if frame and code is not None else None
        self.heard.append(Heard(moment.now, node, request.did, request.cid, request.data, said))
        return [Said(delay, piece) for piece in self.voice.pieces(frame, moment)] if frame else []

    def _frame(self, moment: Moment, code: Code, data: bytes) -> bytes:
        request, node = moment.request, moment.node if moment.node in self._nodes else 1
        number = OLDER.get(code, int(code)) if self.firmware.older else int(code)
        sid = None if request.tid is None else request.tid & 0xF0 | node
        flags = 0x09 if sid is None else 0x29
        plain = Answer(flags, None, sid, request.did, request.cid, request.seq, number, data)
        answer = self.voice.alter(plain, moment)
        if answer is None:
            return b""
        return answer_v1(answer) if self.firmware.older else answer_v2(answer, escape=self.voice.escape)

    def _answer(self, moment: Moment, known_at: float) -> tuple[Word, bytes]:
        request, node = moment.request, moment.node
        wakes = moment.pair == (0x13, 0x0D)
        if self.asleep and not wakes:
            return Nothing.SAID, b""
        if wakes and node == 1:
            self.asleep, self.woken_at = False, moment.now
        if node not in self._nodes:
            return Code.NO_NODE, b""
        if (word := self.firmware.mood(moment)) is not None:
            return word, b""
        if (node, request.did) not in self._devices:
            return self.firmware.no_device, b""
        if self.firmware.masks(node, request.did, len(request.data)) and not self._takes(moment):
            return Code.BAD_LENGTH, b""
        row = self._rows.get((node, request.did, request.cid))
        if row is None:
            return self.firmware.impossible(node, request.did), b""
        return self._run(row, moment, known_at)

    def _takes(self, moment: Moment) -> bool:
        """Whether the command exists and takes this length, so that nothing is there to be masked."""
        row = self._rows.get((moment.node, *moment.pair))
        return row is not None and row.shortest <= len(moment.request.data) <= row.longest

    def _run(self, row: Row, moment: Moment, known_at: float) -> tuple[Code, bytes]:
        data = moment.request.data
        check, first = self.firmware.check(row), data[0] if data else row.from_one
        refused = first > row.limit or (row.from_one and first == 0)
        short, long = len(data) < row.shortest, len(data) > row.longest
        bad = {
            Check.EXACT: short or long,
            Check.SURPLUS_IGNORED: short,
            Check.SHORT_ACCEPTED: long,
            Check.NONE: False,
            Check.AFTERWARDS: False,
        }[check]
        if self.firmware.value_first and data and refused:
            return Code.BAD_VALUE, b""
        if bad:
            return Code.BAD_LENGTH, b""
        if refused and data:
            return Code.BAD_VALUE, b""
        self.ledger.append(Executed(moment.now, known_at, row, data))
        if row.name == "sleep":
            self.asleep = True
        if check is Check.AFTERWARDS and (short or long):
            return Code.BAD_LENGTH, b""
        return self._result(row, moment.node, data)

    def _result(self, row: Row, node: int, data: bytes) -> tuple[Code, bytes]:
        if row.did != 0x10:
            return Code.SUCCESS, row.answer
        claims = self.firmware.claims(self.firmware.rows, node)
        match row.cid:
            case 0x00:
                return Code.SUCCESS, data[:16]
            case 0x05:
                return Code.SUCCESS, bytes(claims)
            case 0x06:
                cids = claims.get(data[0] if data else 0)
                return (Code.BAD_VALUE, b"") if cids is None else (Code.SUCCESS, bytes(cids))
            case 0x09 if data and data[0] in set(Code):
                return Code(data[0]), b""
            case _:
                return Code.SUCCESS, row.answer
