"""A recorded robot behind ``replay:FILE``: it answers as the robot in a journal, report or capture did."""

import asyncio
import math
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from sphero_probe.catalogue import ROBOTS, robot_by_word
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.naming import choose
from sphero_probe.errors import UsageError
from sphero_probe.protocol.address import Address
from sphero_probe.simulator.query import parse_query
from sphero_probe.simulator.recorded import Manner, RecordedRobot, Unknown
from sphero_probe.simulator.setting_values import whole
from sphero_probe.transports.base import BLE_PORT, Connection, OpenOptions
from sphero_probe.transports.recordings import Recording, read_recording
from sphero_probe.transports.simulated import SimulatedTransport


class ReplaySettings(NamedTuple):
    """What follows ``replay:``.

    Attributes:
        path: of the recording.
        unknown: what a command gets that was never recorded.
        speed: factor on the recorded times; 0 answers at once.
        robot: the model, None for what the file says.
        connection: of a capture, None where it holds one robot.
    """

    path: str
    unknown: Unknown | int = Unknown.TOLD
    speed: float = 1.0
    robot: Robot | None = None
    connection: int | None = None


def parse_replay(rest: str) -> ReplaySettings:
    """Read ``FILE?key=value&…``.

    Raises:
        UsageError: an unknown key, a key given twice, a value that does not fit its key.
    """
    path, _, query = rest.partition("?")
    if not path:
        raise UsageError("'replay:' names no file", "try --device replay:run.jsonl")
    values: dict[str, Any] = parse_query(query, KEYS, "replay")
    return ReplaySettings(path, **values)


def recorded_behind(rest: str) -> Recording:
    """Return the recording that an address names, with the model that it says.

    Raises:
        UsageError: the address makes no sense.
        BadInputFileError: the file cannot be used.
    """
    settings = parse_replay(rest)
    recording = read_recording(settings.path, settings.connection)
    if settings.robot is None:
        return recording
    if settings.robot.generation is not recording.generation:
        raise UsageError(
            f"{settings.path} holds {recording.generation.value} packets; {settings.robot.key} sends "
            f"{settings.robot.generation.value}"
        )
    return recording._replace(robot=settings.robot)


def recorded_port(recording: Recording) -> int:
    """Return the port nibble of most target addresses in a recording; that of Bluetooth LE without any."""
    targets = (exchange.command.target for exchange in recording.exchanges)
    ports = Counter(Address.from_byte(target).port for target in targets if target is not None)
    return ports.most_common(1)[0][0] if ports else BLE_PORT


@asynccontextmanager
async def open_connection(rest: str, _options: OpenOptions) -> AsyncIterator[Connection]:
    """Open ``FILE?key=value&…``; each connection plays the recording from its start.

    Raises:
        UsageError: the address makes no sense.
        BadInputFileError: the file cannot be used.
    """
    settings, recording = parse_replay(rest), recorded_behind(rest)
    name = recording.name or Path(settings.path).stem
    manner = Manner(settings.unknown, settings.speed)
    robot = RecordedRobot(settings.path, recording.generation, recording.exchanges, manner)
    port = recorded_port(recording)

    @asynccontextmanager
    async def connect() -> AsyncIterator[Connection]:
        robot.connect(now=asyncio.get_running_loop().time())
        transport = SimulatedTransport(robot)
        try:
            yield Connection(
                transport, recording.generation, recording.robot, name, f"replay:{rest}", port, again=connect
            )
        finally:
            transport.close()

    async with connect() as connection:
        yield connection


def _unknown(text: str) -> Unknown | int:
    words = {word.value: word for word in (Unknown.SILENT, Unknown.ERROR)}
    if text in words:
        return words[text]
    try:
        return whole(0, 0xFF)(text)
    except ValueError:
        raise ValueError(f"a response code such as 0x02, or one of {', '.join(words)} is wanted") from None


def _speed(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise ValueError("a factor such as 2 or 0.5 is wanted; 0 answers at once")
    return value


def _robot(text: str) -> Robot:
    return robot_by_word(text) or ROBOTS[choose(text, ROBOTS, "robot")]


KEYS: Final[dict[str, Callable[[str], object]]] = {
    "unknown": _unknown,
    "speed": _speed,
    "robot": _robot,
    "connection": whole(1),
}
"""Every setting by its name in the address, and how its value is read."""
