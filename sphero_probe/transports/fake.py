"""The built-in robot behind ``fake:``: it gets what is written, and what it sends is read."""

import asyncio
import json
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager, nullcontext
from pathlib import Path
from typing import IO

from sphero_probe.errors import BadInputFileError, OutputError
from sphero_probe.simulator import Executed, FakeRobot, parse_settings, parse_topology
from sphero_probe.simulator.network import Wiring
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.fake_address import CLIENT_PORTS
from sphero_probe.transports.simulated import SimulatedTransport


class FakeTransport(SimulatedTransport[FakeRobot]):
    """A pipe to a ``FakeRobot``."""


class _Lines:
    """A file of JSON lines, written as they happen: opened first it is emptied, opened again it grows."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._mode = "wb"
        self._users = 0
        self._file: IO[bytes] | None = None

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Keep the file open until its last user has left."""
        if self._file is None:
            try:
                self._file = Path(self._path).open(self._mode, buffering=0)  # noqa: SIM115 - its last user closes it
            except OSError as error:
                raise OutputError(f"cannot write {self._path}: {error.strerror}") from error
        self._mode = "ab"
        self._users += 1
        try:
            yield
        finally:
            self._users -= 1
            if not self._users:
                self._file.close()
                self._file = None

    def write(self, line: Mapping[str, object]) -> None:
        if self._file is None:
            return
        try:
            self._file.write(json.dumps(line, separators=(",", ":")).encode() + b"\n")
        except OSError as error:
            raise OutputError(f"cannot write {self._path}: {error.strerror}") from error


class _Home:
    """One fake robot and its evidence, for as many connections as are made to it."""

    def __init__(self, rest: str) -> None:
        settings = parse_settings(rest)
        self._address = f"fake:{rest}"
        self._truth = _Lines(settings.truth) if settings.truth else None
        self._ledger = _Lines(settings.ledger) if settings.ledger else None
        wiring = _read_topology(settings.topology) if settings.topology else None
        self._port = CLIENT_PORTS[settings.line]
        self._robot = FakeRobot(settings, on_execute=self._note, wiring=wiring)

    @asynccontextmanager
    async def connect(self) -> AsyncIterator[Connection]:
        """Open a line to the robot, in place of the one there may be."""
        with self._ledger.opened() if self._ledger else nullcontext():
            self._tell_truth()
            robot = self._robot
            robot.connect(now=asyncio.get_running_loop().time())
            transport = FakeTransport(robot)
            try:
                yield Connection(
                    transport,
                    robot.model.generation,
                    robot.model,
                    robot.name,
                    self._address,
                    self._port,
                    again=self.connect,
                )
            finally:
                transport.close()

    def _tell_truth(self) -> None:
        """Write every command that exists, once."""
        truth, self._truth = self._truth, None
        if truth:
            with truth.opened():
                for fact in self._robot.truth():
                    truth.write(fact.as_json())

    def _note(self, executed: Executed) -> None:
        if self._ledger:
            self._ledger.write(executed.as_json())


def _read_topology(name: str) -> Wiring:
    try:
        text = Path(name).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise BadInputFileError(f"cannot read topology {name}: {reason}") from error
    return parse_topology(text, name)


def built_in_robot(rest: str) -> FakeRobot:
    """Return the robot of an address, with no line to it and no evidence kept.

    Args:
        rest: of the address, ``MODEL?key=value&…``.

    Raises:
        UsageError: an unknown model or key, or a value that makes no sense.
        BadInputFileError: the topology file cannot be read, or is none.
    """
    settings = parse_settings(rest)
    return FakeRobot(settings, wiring=_read_topology(settings.topology) if settings.topology else None)


@asynccontextmanager
async def open_connection(rest: str, _options: OpenOptions) -> AsyncIterator[Connection]:
    """Open ``MODEL?key=value&…``; ``Connection.again`` reaches the same robot, whose ledger then grows on.

    Raises:
        UsageError: an unknown model or key, or a value that makes no sense.
        BadInputFileError: the topology file cannot be read, or is none.
        OutputError: the truth or ledger file cannot be written.
    """
    async with _Home(rest).connect() as connection:
        yield connection
