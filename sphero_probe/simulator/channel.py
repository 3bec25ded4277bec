"""One direction of a connection: it cuts bytes into packets and delivers each at its time."""

import math
from collections import deque


class Channel:
    """Packets on their way to one end, in order; all times in seconds of the caller's clock.

    With connection events, as Bluetooth LE has them, a packet leaves in the first event *after* it was ready
    that has room: what arrives in an event is answered in the next one at the earliest.
    """

    def __init__(
        self, size: int | None, interval: float | None, per_event: int, *, seconds_per_byte: float = 0.0
    ) -> None:
        """Take how packets travel.

        Args:
            size: bytes of a packet; None for whatever is sent.
            interval: seconds between connection events; None for no events.
            per_event: packets in each event.
            seconds_per_byte: that a byte takes where there are no events.
        """
        self._size = size
        self._interval = interval
        self._per_event = per_event
        self._seconds_per_byte = seconds_per_byte
        self.begin(now=0.0)

    def begin(self, *, now: float) -> None:
        """Forget all that is on its way; events are counted from ``now``."""
        self._under_way: deque[tuple[float, bytes]] = deque()
        self._anchor = now
        self._event = 0
        self._in_event = 0

    def put(self, data: bytes, *, ready: float) -> None:
        """Cut bytes into packets that leave once they are ready."""
        size = self._size or max(1, len(data))
        for at in range(0, len(data), size):
            piece = data[at : at + size]
            self._under_way.append((self._arrival(ready, len(piece)), piece))

    @property
    def due(self) -> float | None:
        """When the next packet arrives, None while none is on its way."""
        return self._under_way[0][0] if self._under_way else None

    def take(self) -> bytes:
        """Return the next packet; there must be one."""
        return self._under_way.popleft()[1]

    def cut_off(self, *, now: float) -> None:
        """Lose what has not arrived by ``now``."""
        self._under_way = deque(packet for packet in self._under_way if packet[0] <= now)

    def _arrival(self, ready: float, size: int) -> float:
        if self._interval is None:
            begins = max(ready, self._under_way[-1][0]) if self._under_way else ready
            return begins + size * self._seconds_per_byte
        event = max(self._event, math.floor((ready - self._anchor) / self._interval) + 1)
        while self._time(event) <= ready or (event == self._event and self._in_event == self._per_event):
            event += 1
        self._in_event = 1 if event != self._event else self._in_event + 1
        self._event = event
        return self._time(event)

    def _time(self, event: int) -> float:
        return self._anchor + event * (self._interval or 0.0)
