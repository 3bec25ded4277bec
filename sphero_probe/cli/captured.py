"""The packets of a capture, with what their neighbours and the catalogue tell about them."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from sphero_probe.captures.packet import CapturedPacket
from sphero_probe.captures.reader import Capture, open_capture
from sphero_probe.captures.source import Source
from sphero_probe.catalogue.capture_context import CaptureContext
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.robots import robot_by_prefix
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.cli.bug_report import recording
from sphero_probe.errors import BadInputFileError, UnreadableCaptureError
from sphero_probe.protocol.packets import Generation, Packet
from sphero_probe.reports.captures import captured_row
from sphero_probe.reports.rows import Row

_MAX_CONNECTIONS: Final = 64
"""Connections whose context is kept."""


@contextmanager
def capture_in(path: str) -> Iterator[Capture]:
    """Open a capture.

    Raises:
        BadInputFileError: there is no such file, or it is no capture.
    """
    try:
        with recording(path) as file:
            capture = open_capture(Source(file), path)
            if capture is None:
                raise BadInputFileError(
                    f"{path}: not a btsnoop, pcap, pcapng or PacketLogger file",
                    "bytes and text are for: sphero-probe decode",
                )
            yield capture
    except OSError as error:
        raise BadInputFileError(f"{path}: {error.strerror}") from error
    except UnreadableCaptureError as error:
        raise BadInputFileError(f"{path}: {error}") from error


class _Context:
    def __init__(self, spoken: Generation, robot: Robot | None) -> None:
        self.naming = CaptureContext(robot)
        self.sensors = StreamDecoder(spoken, robot)


def captured_rows(capture: Capture, robot: Robot | None) -> Iterator[tuple[CapturedPacket, Packet, Row]]:
    """Yield each packet of a capture as it was read, as it is understood, and as a row.

    Args:
        capture: the file.
        robot: the model whose meaning counts; None takes the one that the robot's name tells.
    """
    contexts: dict[tuple[int, Generation], _Context] = {}
    for captured in capture.packets():
        name = captured.connection.name
        model = robot or (robot_by_prefix(name) if name else None)
        key = (captured.connection.number, captured.generation)
        context = contexts.get(key)
        if context is None:
            if len(contexts) >= _MAX_CONNECTIONS:
                del contexts[next(iter(contexts))]
            context = contexts[key] = _Context(captured.generation, model)
        packet = context.naming.complete(captured.generation, captured.packet)
        context.sensors.observe(packet)
        yield captured, packet, captured_row(captured, packet, model, context.sensors)
