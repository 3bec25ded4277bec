"""A robot that answers as one did in a recording; bytes in, bytes out, no I/O and no clock.

It knows no firmware, only exchanges. A command gets what was recorded for its node, DID, CID and payload; if
that was asked several times, the answers come in their order, and the last one repeats. Where only other
payloads were recorded for the pair, one of the same length answers, else that of the nearest length. There is
one exception: a success proves nothing about a length that the catalogue does not know the command to take. A
pair that only ever repeated its payload is an echo, and repeats this one.

A command that was never recorded gets ``NOT_RECORDED``, a code in no document with words as its payload, so
that neither a client nor a report takes it for an answer of the robot.
"""

from collections.abc import Callable, Iterable, Iterator
from enum import Enum
from heapq import heappop, heappush
from typing import Final, NamedTuple

from sphero_probe.catalogue import lookup
from sphero_probe.errors import BadInputFileError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.address import PRIMARY, WILDCARD, Address
from sphero_probe.protocol.packets import Command, Generation, Request, Response, Role, Verdict
from sphero_probe.simulator.response_style import RESPONSE_STYLES
from sphero_probe.simulator.topology import INTERNAL

NOT_RECORDED: Final = 0xEE
"""The code of the answer to a command that was never recorded; neither generation documents it."""
NOT_RECORDED_TEXT: Final = b"not recorded"
"""The payload of that answer."""
_ECHO: Final = 2
"""Bytes that an answer must repeat to show an echo: one byte may be chance."""


class Unknown(Enum):
    """What a command gets that was never recorded, if no response code was chosen for it."""

    TOLD = "told"
    """The answer ``NOT_RECORDED``."""
    SILENT = "silent"
    ERROR = "error"
    """An exception ends the conversation."""


class RecordedExchange(NamedTuple):
    """A command and how it ended.

    Attributes:
        command: as it was sent.
        response: the answer, None for silence.
        delay: seconds until the answer.
    """

    command: Command
    response: Response | None
    delay: float = 0.0


class Manner(NamedTuple):
    """How recordings are played.

    Attributes:
        unknown: what a command gets that was never recorded: a response code, or a kind of ending.
        speed: factor on the recorded times; 0 answers at once.
    """

    unknown: Unknown | int = Unknown.TOLD
    speed: float = 1.0


def is_not_recorded(response: Response) -> bool:
    """Whether an answer says that the recording has none."""
    return (response.code, response.payload) == (NOT_RECORDED, NOT_RECORDED_TEXT)


_Pair = tuple[int | None, int, int]
"""Node number, None where the command named none, DID and CID."""


class RecordedRobot:
    """A recorded robot at one end of a connection; the caller passes the time in seconds.

    Attributes:
        connected: always; a recording never drops the line.
        connection: number of the current connection.
        on_drop: never called; a fake robot calls it.
    """

    def __init__(
        self, name: str, generation: Generation, exchanges: Iterable[RecordedExchange], manner: Manner
    ) -> None:
        """Take a recording.

        Args:
            name: of the recording, for messages.
            generation: the protocol.
            exchanges: in the order in which they were recorded.
            manner: how they are played.
        """
        self.connected = True
        self.connection = 1
        self.on_drop: Callable[[], None] = lambda: None
        self._name = name
        self._manner = manner
        self._codec = CODECS[generation]
        self._is_answered = RESPONSE_STYLES[generation].is_answered
        self._recorded: dict[_Pair, dict[bytes, list[RecordedExchange]]] = {}
        for exchange in exchanges:
            command = exchange.command
            payloads = self._recorded.setdefault((_node(command), command.did, command.cid), {})
            payloads.setdefault(command.payload, []).append(exchange)
        self.connect(now=0.0)
        self.connection = 1

    def connect(self, *, now: float) -> None:
        """Begin a new connection: what was recorded is played from its start."""
        del now
        self.connection += 1
        self._decoder = self._codec.decoder(Role.ROBOT)
        self._played: dict[tuple[_Pair, bytes], int] = {}
        self._under_way: list[tuple[float, int, bytes]] = []
        self._last: dict[int | None, float] = {}
        self._sent = 0

    def hear(self, data: bytes, *, now: float) -> None:
        """Take what the host wrote.

        Raises:
            BadInputFileError: it was never recorded, and ``Unknown.ERROR`` was chosen.
        """
        for packet in self._decoder.feed(data):
            if isinstance(packet, Request):
                self._answer(packet, now)

    def speak(self, *, now: float) -> list[bytes]:
        """Return the answers that are due by ``now``."""
        due: list[bytes] = []
        while self._under_way and self._under_way[0][0] <= now:
            due.append(heappop(self._under_way)[2])
        return due

    def next_time(self) -> float | None:
        """Return when the next answer is due, None while none is under way."""
        return self._under_way[0][0] if self._under_way else None

    def _answer(self, request: Request, now: float) -> None:
        exchange = self._find(request)
        if exchange is None:
            response, delay = self._unknown(request), 0.0
        else:
            response, delay = _readdressed(exchange, request), exchange.delay
        if response is None:
            return
        well = self._codec.verdict(response.code) is Verdict.OK
        if not self._is_answered(request, well):
            return
        node = _node(request.command)
        due = now + (delay / self._manner.speed if self._manner.speed else 0.0)
        due = self._last[node] = max(due, self._last.get(node, due))  # a node answers in order
        self._sent += 1
        heappush(self._under_way, (due, self._sent, self._codec.encode_response(response)))

    def _unknown(self, request: Request) -> Response | None:
        command, unknown = request.command, self._manner.unknown
        if unknown is Unknown.SILENT:
            return None
        if unknown is Unknown.ERROR:
            where = "" if command.target is None else f" to node {Address.from_byte(command.target).node}"
            raise BadInputFileError(
                f"{self._name}: 0x{command.did:02x}:0x{command.cid:02x}{where} was never recorded",
                "leave unknown=error out to get an answer that says so",
            )
        code, payload = (NOT_RECORDED, NOT_RECORDED_TEXT) if isinstance(unknown, Unknown) else (unknown, b"")
        response = Response(request.seq, code, payload, command.did, command.cid)
        if command.target is None:
            return response
        asked = Address.from_byte(command.target)
        response = response._replace(source=asked._replace(port=INTERNAL).byte)
        if request.source is None:
            return response
        return response._replace(target=Address.from_byte(request.source)._replace(port=asked.port).byte)

    def _find(self, request: Request) -> RecordedExchange | None:
        """Return what was recorded for a command, or for the most similar one of the same pair."""
        command = request.command
        for pair in self._pairs(command):
            payloads = self._recorded.get(pair)
            if payloads is None:
                continue
            if command.payload not in payloads and self._is_echo(payloads):
                return _echoed(next(iter(payloads.values()))[0], command.payload)
            nearest = _nearest(payloads, command.payload)
            if not self._may_stand_for(payloads[nearest][0], command):
                return None
            played = self._played.get((pair, nearest), 0)
            self._played[pair, nearest] = played + 1
            exchanges = payloads[nearest]
            return exchanges[min(played, len(exchanges) - 1)]
        return None

    def _may_stand_for(self, exchange: RecordedExchange, command: Command) -> bool:
        """Whether an answer tells what a payload of another length gets."""
        length = len(command.payload)
        if len(exchange.command.payload) == length or exchange.response is None:
            return True
        if self._codec.verdict(exchange.response.code) is not Verdict.OK:
            return True
        row = lookup(self._codec.generation, command.did, command.cid, None)
        return row is not None and row.request is not None and row.request.accepts(length)

    def _pairs(self, command: Command) -> Iterator[_Pair]:
        """Yield where a command may be recorded: at its node, or without one.

        A command without a node is for the node that receives it, and node 0 for any that can serve it.
        """
        did, cid = command.did, command.cid
        node = _node(command)
        yield node, did, cid
        if node in (None, WILDCARD):
            yield from sorted(
                (pair for pair in self._recorded if pair[0] is not None and pair[1:] == (did, cid)),
                key=lambda pair: pair[0] or 0,
            )
        if node in (PRIMARY, WILDCARD):
            yield None, did, cid

    def _is_echo(self, payloads: dict[bytes, list[RecordedExchange]]) -> bool:
        """Whether every success repeats its command's payload, and some payload is long enough to tell."""
        answers = [
            (payload, exchange.response.payload)
            for payload, exchanges in payloads.items()
            for exchange in exchanges
            if exchange.response and self._codec.verdict(exchange.response.code) is Verdict.OK
        ]
        same = all(asked == said for asked, said in answers)
        return same and max((len(asked) for asked, _ in answers), default=0) >= _ECHO


def _node(command: Command) -> int | None:
    return None if command.target is None else Address.from_byte(command.target).node


def _nearest(payloads: Iterable[bytes], payload: bytes) -> bytes:
    """Return the payload itself if it is there, else the first of the nearest length, the shorter of two."""
    return min(payloads, key=lambda one: (one != payload, abs(len(one) - len(payload)), len(one)))


def _echoed(exchange: RecordedExchange, payload: bytes) -> RecordedExchange:
    response = exchange.response
    return exchange._replace(response=response and response._replace(payload=payload))


def _readdressed(exchange: RecordedExchange, request: Request) -> Response | None:
    """Return the recorded answer with the request's number, and no address that the request lacks."""
    response = exchange.response
    if response is None:
        return None
    has_addresses = request.command.target is not None or exchange.command.target is None
    source = response.source if has_addresses else None
    target = response.target if request.source is not None else None
    return response._replace(seq=request.seq, source=source, target=target)
