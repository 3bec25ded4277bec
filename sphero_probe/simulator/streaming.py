"""The sensor stream of a resting robot: masks and times come in, payloads of 18/02 go out when due."""

from random import Random
from struct import Struct
from typing import Final

DATA: Final = (0x18, 0x02)
"""The notification that carries the floats."""
REQUEST: Final = Struct(">HBI")
"""Interval in ms, number of samples (0: endless), mask."""

_CHANNELS: Final[dict[int, tuple[float, float] | None]] = {
    25: (-0.02, 0.02),  # quaternion x, y, z, w
    24: (-0.02, 0.02),
    23: (-0.02, 0.02),
    22: (0.99, 1.0),
    18: (-2.0, 2.0),  # pitch, roll, yaw in degrees
    17: (-2.0, 2.0),
    16: (-9.0, 9.0),
    15: (-0.05, 0.05),  # acceleration x, y, z in g
    14: (-0.05, 0.05),
    13: (0.95, 1.05),
    9: (0.95, 1.05),  # its magnitude
    6: (-1.0, 1.0),  # place x, y in cm
    5: (-1.0, 1.0),
    4: (-0.1, 0.1),  # velocity x, y in cm/s
    3: (-0.1, 0.1),
    2: (0.0, 0.1),  # speed
    1: None,  # milliseconds, counting up
}
"""Bit of the mask -> between what its reading lies; one float each, the highest bit first [code]."""
_EXTENDED: Final[dict[int, tuple[float, float]]] = {
    26: (-1.0, 1.0),  # head angle in degrees
    25: (-0.5, 0.5),  # rotation x, y, z in degrees/s
    24: (-0.5, 0.5),
    23: (-0.5, 0.5),
    18: (90.0, 110.0),  # ambient light
}
"""The same for the extended mask, whose floats follow."""
_BACKLOG: Final = 64
"""Samples that a robot can hold back; what is older when somebody listens again is gone."""


class Stream:
    """One running stream.

    Attributes:
        node: the processor it comes from.
        due: when the next sample is sent, in seconds of the caller's clock; None once the last one is.
    """

    def __init__(self, node: int, request: bytes, extended: int, *, seed: int, now: float) -> None:
        interval, count, mask = REQUEST.unpack(request)
        self.node = node
        self._interval = interval / 1000
        self._left: int | None = count or None
        self._readings = [_CHANNELS[bit] for bit in _CHANNELS if mask >> bit & 1]
        self._readings += [_EXTENDED[bit] for bit in _EXTENDED if extended >> bit & 1]
        self._chance = Random(f"{seed} stream")
        self._elapsed = 0.0
        self.due: float | None = now + self._interval if interval and self._readings else None

    def sample(self, *, now: float) -> tuple[float, bytes] | None:
        """Return when the next sample was due and its payload; None while nothing is due by ``now``."""
        if self.due is None or self.due > now:
            return None
        self.due = max(self.due, now - _BACKLOG * self._interval)
        sent, self._elapsed = self.due, self._elapsed + 1000 * self._interval
        if self._left is not None:
            self._left -= 1
        self.due = None if self._left == 0 else sent + self._interval
        floats = [self._chance.uniform(*reading) if reading else self._elapsed for reading in self._readings]
        return sent, Struct(f">{len(floats)}f").pack(*floats)
