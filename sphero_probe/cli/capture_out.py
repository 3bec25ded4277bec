"""``--capture``: what is said on the link, written to a pcapng file as it happens."""

import asyncio
import re
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from io import FileIO
from pathlib import Path
from typing import Final

from sphero_probe import __version__
from sphero_probe.captures.pcapng_out import head, packet
from sphero_probe.captures.record import Record
from sphero_probe.captures.synthetic import BleScript, Script, SerialScript
from sphero_probe.cli.messages import warn
from sphero_probe.errors import OutputError
from sphero_probe.link.events import BytesReceived, Events, FrameSent, LinkEvent
from sphero_probe.protocol.packets import Generation

_MAC: Final = re.compile(r"(?:[0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2}")
NO_ADDRESS: Final = "C0:00:00:00:00:00"
"""Stands for the address of a robot that was named otherwise."""
_SERIAL: Final = ("serial:", "rfcomm:")


@contextmanager
def capturing(path: str | None, device: str, events: Events) -> Iterator[None]:
    """Write all frames to a file while the context is open; each block is written whole, at once.

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
        try:
            file = stack.enter_context(Path(path).open("wb", buffering=0))
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror}") from error
        stack.enter_context(events.subscribe(_Tap(file, path, device).heard, FrameSent, BytesReceived))
        yield


class _Tap:
    """Writes events; after an error it stops, and the run goes on."""

    def __init__(self, file: FileIO, path: str, device: str) -> None:
        self._file, self._path, self._device = file, path, device
        self._script: Script | None = None
        self._broken = False

    def heard(self, event: LinkEvent) -> None:
        """Write a frame that was sent, or bytes that were received."""
        if self._broken or not isinstance(event, FrameSent | BytesReceived):
            return
        ago = asyncio.get_running_loop().time() - event.time
        when = time.time_ns() - int(ago * 1_000_000_000)
        try:
            if self._script is None:
                data = event.frame if isinstance(event, FrameSent) else event.data
                self._script = self._begin(data)
                self._file.write(head(f"sphero-probe {__version__}", self._script.link))
                self._write(self._script.opening(when))
            if isinstance(event, FrameSent):
                self._write(self._script.sent(when, event.frame))
            else:
                self._write(self._script.received(when, event.data))
        except OSError as error:
            self._broken = True
            warn(f"cannot write {self._path} any more: {error.strerror}")

    def _begin(self, data: bytes) -> Script:
        if self._device.startswith(_SERIAL):
            return SerialScript()
        generation = Generation.V1 if data[:1] == b"\xff" else Generation.V2
        address = self._device if _MAC.fullmatch(self._device) else NO_ADDRESS
        return BleScript(generation, address, self._device or "robot")

    def _write(self, records: Iterator[Record]) -> None:
        self._file.write(b"".join(map(packet, records)))
