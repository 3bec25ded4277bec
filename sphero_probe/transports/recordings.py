"""Read the exchanges in a journal, a JSON report or a capture; the file may come from a stranger.

Only what was on the wire is taken from a journal or report: the hexadecimal ``sent`` and ``received`` of its
findings, and of the exchanges in its notes. The codecs decode them again.
"""

import os
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Final, NamedTuple

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.model import Robot
from sphero_probe.errors import BadInputFileError, UnreadableCaptureError
from sphero_probe.json_files import JsonObjects, open_regular
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Request, Response, Role
from sphero_probe.simulator.recorded import RecordedExchange

MAX_EXCHANGES: Final = 1 << 18
_HINT: Final = "recorded runs: sphero-probe runs"
_MAX_NAME: Final = 64
MAX_DELAY: Final = 600.0
"""Seconds that an answer is held back at most."""
EXCHANGES: Final = "exchanges"
"""Kind of the notes of a run that keep what was asked outside its probes, and the key of their list."""
_HEADS: Final = ("journal", "run")


class Recording(NamedTuple):
    """What a file holds of one robot.

    Attributes:
        generation: the protocol it speaks.
        robot: the model, None where the file does not tell.
        name: of the robot; empty where the file does not tell.
        exchanges: in the order of the file.
    """

    generation: Generation
    robot: Robot | None
    name: str
    exchanges: tuple[RecordedExchange, ...]


def read_recording(path: str, connection: int | None = None) -> Recording:
    """Return what a file holds.

    Args:
        path: of the file.
        connection: number of the connection of a capture; None where it holds one robot.

    Raises:
        BadInputFileError: it cannot be read, or holds no exchange.
        UsageError: the capture holds several robots and none was chosen, or there is no such connection.
    """
    with open_regular(path, _HINT) as file:
        status = os.fstat(file.fileno())
        return _read(path, connection, (status.st_dev, status.st_ino, status.st_mtime_ns, status.st_size))


@lru_cache(maxsize=4)
def _read(path: str, connection: int | None, _version: tuple[int, ...]) -> Recording:
    """Read a version of a file once: several layers ask what is in it."""
    with open_regular(path, _HINT) as file:
        try:
            first = file.read(1)
            file.seek(0)
            if first in (b"{", b"["):
                return _of_objects(JsonObjects(file, path, lenient=True), path)

            from sphero_probe.transports.recorded_captures import read_capture

            recording = read_capture(file, path, connection)
        except UnreadableCaptureError as error:
            raise BadInputFileError(f"{path}: {error}") from error
        except OSError as error:
            raise BadInputFileError(f"{path}: {error.strerror}") from error
    if recording is None:
        raise BadInputFileError(
            f"{path}: not a journal, a JSON report, or a btsnoop, pcap, pcapng or PacketLogger capture"
        )
    return recording


def _of_objects(objects: Iterable[dict[str, object]], path: str) -> Recording:
    robot: Robot | None = None
    name = ""
    generation: Generation | None = None
    exchanges: list[RecordedExchange] = []
    for number, data in enumerate(objects, 1):
        if data.get("type") in _HEADS:
            robot = ROBOTS.get(str(data.get("robot"))) or robot
            name = str(data.get("device") or name)[:_MAX_NAME]
        for told in _told(data):
            try:
                sent = _hex(told["sent"])
                generation = generation or _spoken(sent)
                exchange = _exchange(sent, told, generation)
            except ValueError as error:
                raise BadInputFileError(f"{path}: entry {number}: {error}") from error
            if exchange:
                exchanges.append(exchange)
        if len(exchanges) > MAX_EXCHANGES:
            raise BadInputFileError(f"{path}: more than {MAX_EXCHANGES} exchanges")
    return recording_of(path, generation, robot, name, exchanges)


def _told(data: dict[str, object]) -> Iterator[dict[str, object]]:
    """Yield what an entry holds with bytes that were sent: a finding, or the exchanges of a note."""
    told: object = [data] if data.get("type") == "finding" else ()
    if data.get("type") == "note" and data.get("kind") == EXCHANGES:
        details = data.get("data")  # of a journal; a report has them beside the kind
        told = (details if isinstance(details, dict) else data).get(EXCHANGES)
    for one in told if isinstance(told, list) else ():
        if isinstance(one, dict) and one.get("sent"):
            yield one


def _exchange(sent: bytes, data: dict[str, object], generation: Generation) -> RecordedExchange | None:
    """Return an exchange; None if its silence says nothing.

    Raises:
        ValueError: the bytes are no command and its answer.
    """
    codec = CODECS[generation]
    match codec.decoder(Role.ROBOT).feed(sent):
        case [Request() as request]:
            command = request.command
        case _:
            raise ValueError("sent is not one command")
    if not data.get("received"):
        return RecordedExchange(command, None) if request.wants_answer else None
    match codec.decoder(Role.HOST).feed(_hex(data["received"])):
        case [Response() as response]:
            return RecordedExchange(command, response, _delay(data))
        case _:
            raise ValueError("received is not one response")


def _hex(text: object) -> bytes:
    if not isinstance(text, str):
        raise ValueError("bytes that are no text")  # noqa: TRY004 - the caller adds the place
    return bytes.fromhex(text)


def _spoken(frame: bytes) -> Generation:
    """Return the generation that can read a command."""
    for generation, codec in CODECS.items():
        if any(isinstance(packet, Request) for packet in codec.decoder(Role.ROBOT).feed(frame)):
            return generation
    raise ValueError("sent is not one command")


def _delay(data: dict[str, object]) -> float:
    """Return the round trip in seconds; a report has it in milliseconds."""
    for key, unit in (("seconds", 1.0), ("rtt_ms", 0.001)):
        value = data.get(key)
        if isinstance(value, int | float) and value > 0:
            return min(value, MAX_DELAY / unit) * unit
    return 0.0


def recording_of(
    path: str,
    generation: Generation | None,
    robot: Robot | None,
    name: str,
    exchanges: list[RecordedExchange],
) -> Recording:
    """Return a recording.

    Raises:
        BadInputFileError: there is nothing in it.
    """
    if generation is None or not exchanges:
        raise BadInputFileError(f"{path}: no command and its answer in it")
    if robot and robot.generation is not generation:
        robot = None
    return Recording(generation, robot, name[:_MAX_NAME], tuple(exchanges))
