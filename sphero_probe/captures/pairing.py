"""Requests and their answers, per connection: round trips, how many were in flight, in which order.

V2 answers are recognised by SEQ, DID, CID and the node that they come from, V1 answers by SEQ alone.
"""

from typing import Final, NamedTuple

from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Generation, Request, Response

_PATIENCE: Final = 10_000_000_000
"""Nanoseconds after which no answer to a request is expected any more."""
_MAX_OPEN: Final = 256

_Key = tuple[Generation, int, int | None, int | None]


class Answered(NamedTuple):
    """An answer and what it answers.

    Attributes:
        request: the request's packet.
        round_trip: nanoseconds between the two, None where the capture has no times.
        in_order: no later request was answered before.
    """

    request: CapturedPacket
    round_trip: int | None
    in_order: bool


class Pairing:
    """One connection's requests that wait for an answer.

    Attributes:
        most_in_flight: the most requests that waited at once.
    """

    def __init__(self) -> None:
        """Nothing was asked yet."""
        self.most_in_flight = 0
        self._open: dict[_Key, list[tuple[int, CapturedPacket]]] = {}
        self._asked = self._last_answered = 0

    def feed(self, captured: CapturedPacket) -> Answered | None:
        """Take the connection's next packet; return what it answers, None where it answers nothing."""
        match captured.packet:
            case Request(command=command, seq=seq, wants_answer=True):
                self._forget(captured.time)
                self._asked += 1
                key = _key(captured.generation, seq, command.did, command.cid)
                self._open.setdefault(key, []).append((self._asked, captured))
                in_flight = sum(map(len, self._open.values()))
                self.most_in_flight = max(self.most_in_flight, in_flight)
            case Response(seq=seq, did=did, cid=cid, source=source):
                key = _key(captured.generation, seq, did, cid)
                waiting = self._open.get(key, [])
                for entry in waiting:
                    number, request = entry
                    if _same_node(request, source):
                        waiting.remove(entry)
                        if not waiting:
                            del self._open[key]
                        in_order = number > self._last_answered
                        self._last_answered = max(number, self._last_answered)
                        return Answered(request, _between(request.time, captured.time), in_order)
            case _:
                pass
        return None

    def _forget(self, now: int | None) -> None:
        """Drop what no answer is expected to any more; the oldest come first."""
        for key, waiting in tuple(self._open.items()):
            age = _between(waiting[0][1].time, now)
            if len(self._open) < _MAX_OPEN and not (age and age > _PATIENCE):
                return
            del self._open[key]


def _key(generation: Generation, seq: int, did: int | None, cid: int | None) -> _Key:
    named = CODECS[generation].answers_name_commands
    return (generation, seq, did, cid) if named else (generation, seq, None, None)


def _same_node(request: CapturedPacket, source: int | None) -> bool:
    target = request.packet.command.target if isinstance(request.packet, Request) else None
    if source is None or target is None:
        return True
    asked = Address.from_byte(target)
    return asked.is_wildcard or asked.node == Address.from_byte(source).node


def _between(first: int | None, second: int | None) -> int | None:
    return None if first is None or second is None else second - first
