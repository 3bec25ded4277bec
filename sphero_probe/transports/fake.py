"""The built-in robot behind ``fake:``: what is written it hears, what it says is read."""

import asyncio
import json
from collections.abc import AsyncIterator, Mapping
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path
from typing import TextIO

from sphero_probe.errors import LinkLostError, OutputError
from sphero_probe.simulator import Executed, FakeRobot, Settings, parse_settings
from sphero_probe.transports.base import Connection, OpenOptions


class FakeTransport:
    """A pipe to a ``FakeRobot`` on the event loop's clock."""

    def __init__(self, robot: FakeRobot) -> None:
        self.robot = robot
        self._stirred = asyncio.Event()
        self._ready: list[bytes] = []
        self._closed = False

    async def write(self, data: bytes) -> None:
        """Let the robot hear bytes."""
        if self._closed:
            raise LinkLostError("the fake robot is disconnected")
        self.robot.hear(data, now=asyncio.get_running_loop().time())
        self._stirred.set()

    async def read(self) -> bytes:
        """Wait until the robot says something and return one chunk of it."""
        loop = asyncio.get_running_loop()
        while not self._ready:
            if self._closed:
                return b""
            self._ready = self.robot.speak(now=loop.time())
            if self._ready:
                break
            self._stirred.clear()
            due = self.robot.next_time()
            try:
                async with asyncio.timeout_at(due):
                    await self._stirred.wait()
            except TimeoutError:
                continue
        return self._ready.pop(0)

    def close(self) -> None:
        """End the conversation; a waiting ``read`` returns ``b""``."""
        self._closed = True
        self._stirred.set()


class _Lines:
    """A file of JSON lines, written as they happen."""

    def __init__(self, path: str, files: ExitStack) -> None:
        self._path = path
        try:
            file = Path(path).open("w", encoding="utf-8", buffering=1)  # noqa: SIM115 - the stack closes it
            self._file: TextIO = files.enter_context(file)
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror}") from error

    def write(self, line: Mapping[str, object]) -> None:
        try:
            self._file.write(json.dumps(line, separators=(",", ":")) + "\n")
        except OSError as error:
            raise OutputError(f"cannot write {self._path}: {error.strerror}") from error


def _furnish(settings: Settings, files: ExitStack) -> FakeRobot:
    """Build the robot; ``truth`` is written at once, ``ledger`` grows as commands are executed."""
    ledger = _Lines(settings.ledger, files) if settings.ledger else None

    def note(executed: Executed) -> None:
        if ledger:
            ledger.write(executed.as_json())

    robot = FakeRobot(settings, on_execute=note)
    if settings.truth:
        truth = _Lines(settings.truth, files)
        for fact in robot.truth():
            truth.write(fact.as_json())
    return robot


@asynccontextmanager
async def open_connection(rest: str, _options: OpenOptions) -> AsyncIterator[Connection]:
    """Open ``MODEL?key=value&…``.

    Raises:
        UsageError: an unknown model or key, or a value that makes no sense.
        OutputError: the truth or ledger file cannot be written.
    """
    settings = parse_settings(rest)
    with ExitStack() as files:
        robot = _furnish(settings, files)
        transport = FakeTransport(robot)
        try:
            yield Connection(transport, robot.model.generation, robot.model, robot.name, f"fake:{rest}")
        finally:
            transport.close()
