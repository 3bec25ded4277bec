"""The exchanges of one robot in a capture."""

from collections.abc import Iterable
from typing import BinaryIO

from sphero_probe.captures.packet import Connection
from sphero_probe.captures.pairing import Pairing
from sphero_probe.captures.reader import Capture, open_capture
from sphero_probe.captures.source import Source
from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.protocol.packets import Generation, Request, Response
from sphero_probe.simulator.recorded import RecordedExchange
from sphero_probe.transports.recordings import MAX_DELAY, MAX_EXCHANGES, Recording, recording_of


def read_capture(file: BinaryIO, path: str, connection: int | None) -> Recording | None:
    """Return what a capture holds; None where the file is none.

    Args:
        file: at its start.
        path: of the file, for messages.
        connection: number of the connection, None where the file holds one robot.

    Raises:
        BadInputFileError: it cannot be read, or holds no exchange.
        UsageError: it holds several robots and none was chosen, or there is no such connection.
        OSError: the file cannot be read.
    """
    capture = open_capture(Source(file), path)
    return _recording(capture, path, connection) if capture else None


class _Talk:
    """One connection of a capture: its commands, and what they got."""

    def __init__(self, connection: Connection, generation: Generation) -> None:
        self.connection, self.generation = connection, generation
        self.pairing = Pairing()
        self.exchanges: list[RecordedExchange] = []
        self.places: dict[int, int] = {}
        self.answered = 0

    def settled(self) -> list[RecordedExchange]:
        """Return what was answered, and the silences before the last answer: the rest may be cut off."""
        return self.exchanges[: self.answered]


def _recording(capture: Capture, path: str, wanted: int | None) -> Recording:
    talks: dict[int, _Talk] = {}
    count = 0
    for captured in capture.packets():
        number = captured.connection.number
        talk = talks.setdefault(number, _Talk(captured.connection, captured.generation))
        talk.connection = captured.connection
        if captured.generation is not talk.generation or (wanted or number) != number:
            continue
        answered = talk.pairing.feed(captured)
        match captured.packet:
            case Request(command=command, wants_answer=True):
                talk.places[id(captured)] = len(talk.exchanges)
                talk.exchanges.append(RecordedExchange(command, None))
                count += 1
            case Response() as response if answered:
                at = talk.places[id(answered.request)]
                delay = min(max((answered.round_trip or 0) / 1e9, 0.0), MAX_DELAY)
                command = talk.exchanges[at].command
                talk.exchanges[at] = RecordedExchange(command, response, delay)
                talk.answered = max(talk.answered, at + 1)
            case _:
                pass
        if count > MAX_EXCHANGES:
            raise BadInputFileError(f"{path}: more than {MAX_EXCHANGES} exchanges")
    if wanted is not None and wanted not in talks:
        raise UsageError(f"{path}: no robot on connection {wanted}", _listed(talks.values()))
    heard = [talk for talk in talks.values() if talk.answered]
    if len({talk.connection.name or talk.connection.peer for talk in heard}) > 1:
        raise UsageError(f"{path}: several robots; choose one with ?connection=N", _listed(heard))
    exchanges = [exchange for talk in heard for exchange in talk.settled()]
    name = (heard[0].connection.name or "") if heard else ""
    generation = heard[0].generation if heard else None
    return recording_of(path, generation, robot_by_prefix(name) if name else None, name, exchanges)


def _listed(talks: Iterable[_Talk]) -> str:
    return "connections: " + ", ".join(talk.connection.label for talk in talks)
