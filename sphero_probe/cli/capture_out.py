"""``--capture``: what is said on the link, written to a pcapng file as it happens.

A comment on each frame of a probe says its number and its command. What came of the probe is known only
later. The block of an answer waits for it, ``_PATIENCE`` at most, and gets it as a comment. A verdict without
such an answer, for example that the robot is silent, is a line of its own among the packets.
"""

import asyncio
import re
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from io import FileIO
from pathlib import Path
from typing import Final

from sphero_probe import __version__
from sphero_probe.captures.pcapng_out import PcapngWriter
from sphero_probe.captures.record import Record
from sphero_probe.captures.synthetic import BleScript, Script, SerialScript
from sphero_probe.cli.messages import warn
from sphero_probe.errors import OutputError
from sphero_probe.link.events import (
    BytesReceived,
    Events,
    ExchangeEnded,
    FrameSent,
    LinkEvent,
    ProbeComment,
    ProbeCommented,
)
from sphero_probe.link.exchange import Answered
from sphero_probe.protocol.packets import Generation

_MAC: Final = re.compile(r"(?:[0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2}")
NO_ADDRESS: Final = "C0:00:00:00:00:00"
"""Stands for the address of a robot that was named otherwise."""
_SERIAL: Final = ("serial:", "rfcomm:")
_PATIENCE: Final = 0.25
"""Seconds that the block of an answer waits for the verdict."""
_SECOND: Final = 1_000_000_000
"""In nanoseconds."""
_MAX_PROBES: Final = 1 << 12


@contextmanager
def capturing(path: str | None, device: str, events: Events) -> Iterator[None]:
    """Write all frames to a file while the context is open; each block is written whole.

    Args:
        path: the file, None to write none.
        device: the robot as it was named.
        events: of the link.

    Raises:
        OutputError: the file cannot be written.
    """
    if path is None:
        yield
        return
    with ExitStack() as stack:
        writer = PcapngWriter(f"sphero-probe {__version__}")
        try:
            file = stack.enter_context(Path(path).open("wb", buffering=0))
            file.write(writer.start())
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror}") from error
        tap = _Tap(file, path, device, writer)
        stack.callback(tap.close)
        kinds = (FrameSent, BytesReceived, ExchangeEnded, ProbeCommented)
        stack.enter_context(events.subscribe(tap.heard, *kinds))
        yield


class _Waiting:
    """The records of one event, with the probes whose verdict they wait for; or comments without records."""

    def __init__(self, records: list[Record], heard: float, comments: list[str]) -> None:
        self.records, self.heard, self.comments = records, heard, comments
        self.probes: set[int] = set()


class _Tap:
    """Writes events; after an error it stops, and the run goes on."""

    def __init__(self, file: FileIO, path: str, device: str, writer: PcapngWriter) -> None:
        self._file, self._path, self._device, self._writer = file, path, device, writer
        self._script: Script | None = None
        self._broken = False
        self._queue: deque[_Waiting] = deque()
        self._offset = 0
        self._next: ProbeComment | None = None
        self._numbers: dict[bytes, int] = {}
        self._answers: dict[int, _Waiting] = {}
        self._timer: asyncio.Handle | None = None

    def heard(self, event: LinkEvent) -> None:
        """Take an event of the link."""
        match event:
            case FrameSent(time=at, frame=frame):
                self._sent(at, frame)
            case BytesReceived(time=at, data=data):
                self._add(at, data, [], sent=False)
            case ExchangeEnded(exchange=Answered(sent=frame)):
                self._answered(frame)
            case ProbeCommented(comment=comment):
                self._commented(event.time, comment)
            case _:
                return
        if self._timer:
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_soon(self._write_ready)

    def close(self) -> None:
        """Write what still waits."""
        if self._timer:
            self._timer.cancel()
        while self._queue:
            self._write(self._queue.popleft())
        if self._script is None:
            warn(f"nothing was said to a robot: {self._path} has no packets")

    def _sent(self, at: float, frame: bytes) -> None:
        comment, self._next = self._next, None
        if comment:
            if len(self._numbers) >= _MAX_PROBES:
                del self._numbers[next(iter(self._numbers))]
            self._numbers[frame] = comment.number
        self._add(at, frame, [comment.text] if comment else [], sent=True)

    def _answered(self, frame: bytes) -> None:
        number = self._numbers.pop(frame, None)
        if number is not None and self._queue:
            self._queue[-1].probes.add(number)
            self._answers[number] = self._queue[-1]

    def _commented(self, at: float, comment: ProbeComment) -> None:
        if not comment.is_verdict:
            self._next = comment
        elif waiting := self._answers.pop(comment.number, None):
            waiting.comments.append(comment.text)
            waiting.probes.discard(comment.number)
        else:
            self._queue.append(_Waiting([], at, [comment.text]))

    def _add(self, at: float, data: bytes, comments: list[str], *, sent: bool) -> None:
        when = self._wall_clock(at)
        opening: list[Record] = []
        if self._script is None:
            self._script = self._begin(data)
            opening = list(self._script.opening(when))
        records = (self._script.sent if sent else self._script.received)(when, data)
        self._queue.append(_Waiting([*opening, *records], at, comments))

    def _wall_clock(self, at: float) -> int:
        """Return nanoseconds since 1970 for a time of the loop; they rise as it does, but after a sleep."""
        offset = time.time_ns() - int(asyncio.get_running_loop().time() * _SECOND)
        if abs(offset - self._offset) > _SECOND:
            self._offset = offset
        return self._offset + int(at * _SECOND)

    def _begin(self, data: bytes) -> Script:
        generation = Generation.V1 if data[:1] == b"\xff" else Generation.V2
        return script_of(generation, self._device)

    def _write_ready(self) -> None:
        loop = asyncio.get_running_loop()
        self._timer = None
        now = loop.time()
        while self._queue:
            waiting = self._queue[0]
            left = _PATIENCE - (now - waiting.heard)
            if waiting.probes and left > 0:
                self._timer = loop.call_later(left, self._write_ready)
                return
            self._write(self._queue.popleft())

    def _write(self, waiting: _Waiting) -> None:
        for number in waiting.probes:
            self._answers.pop(number, None)
        if not waiting.records:
            self._append(b"".join(self._writer.entry(time.time_ns(), text) for text in waiting.comments))
            return
        *first, last = waiting.records
        self._append(b"".join(map(self._writer.packet, first)) + self._writer.packet(last, waiting.comments))

    def _append(self, blocks: bytes) -> None:
        if self._broken:
            return
        try:
            self._file.write(blocks)
        except OSError as error:
            self._broken = True
            warn(f"cannot write {self._path} any more: {error.strerror}")


def script_of(generation: Generation, device: str, name: str = "") -> Script:
    """Return how a robot's conversation is written.

    Args:
        generation: the protocol.
        device: the robot as it was addressed.
        name: its name, empty where it is not known.
    """
    if device.startswith(_SERIAL):
        return SerialScript()
    address = device if _MAC.fullmatch(device) else NO_ADDRESS
    return BleScript(generation, address, name or device or "robot")
