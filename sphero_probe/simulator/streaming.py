"""The sensor streams of a resting robot: what is sent when."""

from random import Random
from typing import Final, NamedTuple, Protocol

from sphero_probe.catalogue.payload.layout import Field, Layout

AT_REST: Final[dict[str, tuple[float, float]]] = {
    "quaternion_x": (-0.02, 0.02),
    "quaternion_y": (-0.02, 0.02),
    "quaternion_z": (-0.02, 0.02),
    "quaternion_w": (0.99, 1.0),
    "pitch": (-2.0, 2.0),
    "roll": (-2.0, 2.0),
    "yaw": (-9.0, 9.0),
    "accelerometer_x": (-0.05, 0.05),
    "accelerometer_y": (-0.05, 0.05),
    "accelerometer_z": (0.95, 1.05),
    "accelerometer_raw_x": (-0.05, 0.05),
    "accelerometer_raw_y": (-0.05, 0.05),
    "accelerometer_raw_z": (0.95, 1.05),
    "accel_one": (0.95, 1.05),
    "locator_x": (-1.0, 1.0),
    "locator_y": (-1.0, 1.0),
    "velocity_x": (-0.1, 0.1),
    "velocity_y": (-0.1, 0.1),
    "speed": (0.0, 0.1),
    "head_angle": (-1.0, 1.0),
    "gyroscope_x": (-0.5, 0.5),
    "gyroscope_y": (-0.5, 0.5),
    "gyroscope_z": (-0.5, 0.5),
    "extended_gyroscope_x": (-0.5, 0.5),
    "extended_gyroscope_y": (-0.5, 0.5),
    "extended_gyroscope_z": (-0.5, 0.5),
    "gyroscope_raw_x": (-5.0, 5.0),
    "gyroscope_raw_y": (-5.0, 5.0),
    "gyroscope_raw_z": (-5.0, 5.0),
    "ambient_light": (90.0, 110.0),
}
"""Sensor -> the range of its reading; sensors that are not listed read zero."""
_CLOCK: Final = "core_time"
"""The sensor that counts milliseconds up."""
BACKLOG: Final = 64
"""Packets that a robot can hold back until they are read; older ones are lost."""


MASK_STREAM: Final = 0
"""Stands for the token of a stream that was asked for by a mask, of which a node has one."""


class Streaming(Protocol):
    """Anything that a robot sends at regular times."""

    @property
    def node(self) -> int:
        """The processor it comes from."""

    @property
    def pair(self) -> tuple[int | None, int]:
        """(did, cid) of its notifications."""

    @property
    def due(self) -> float | None:
        """When the next one is sent, in seconds of the caller's clock; None once the last one is."""

    def sample(self, *, now: float) -> tuple[float, bytes] | None:
        """Return when the next one was due and its payload; None while nothing is due by ``now``."""


class StreamRequest(NamedTuple):
    """What a client wants streamed.

    Attributes:
        node: the processor it comes from.
        pair: (did, cid) of the notifications.
        interval: seconds between them.
        packets: how many of them, 0 for no end.
        layout: of one frame.
        frames: in each packet.
    """

    node: int
    pair: tuple[int | None, int]
    interval: float
    packets: int
    layout: Layout
    frames: int = 1


class Stream:
    """One running stream.

    Attributes:
        node: the processor it comes from.
        pair: (did, cid) of the notifications.
        due: when the next packet is sent, in seconds of the caller's clock; None once the last one is.
    """

    def __init__(self, request: StreamRequest, *, seed: int, now: float) -> None:
        self._request = request
        self.node = request.node
        self.pair = request.pair
        self._left: int | None = request.packets or None
        self._chance = Random(f"{seed} stream")
        self._elapsed = 0.0
        self.due: float | None = (
            now + request.interval if request.interval and request.layout.fields else None
        )

    def sample(self, *, now: float) -> tuple[float, bytes] | None:
        """Return when the next packet was due and its payload; None while nothing is due by ``now``."""
        if self.due is None or self.due > now:
            return None
        interval, frames = self._request.interval, self._request.frames
        self.due = max(self.due, now - BACKLOG * interval)
        sent = self.due
        if self._left is not None:
            self._left -= 1
        self.due = None if self._left == 0 else sent + interval
        return sent, b"".join(self._frame(1000 * interval / frames) for _ in range(frames))

    def _frame(self, milliseconds: float) -> bytes:
        self._elapsed += milliseconds
        layout = self._request.layout
        return layout.encode({field.name: self._reading(field) for field in layout.fields})

    def _reading(self, field: Field) -> float:
        if field.name == _CLOCK:
            return self._elapsed
        return self._chance.uniform(*AT_REST.get(field.name, (0.0, 0.0)))
