"""The connection between host and robot: it delivers packets late, cut up, damaged, or not at all."""

from random import Random
from typing import Final, NamedTuple

from sphero_probe.simulator.channel import Channel
from sphero_probe.simulator.measured_timing import SPLIT, round_trip
from sphero_probe.simulator.settings import Line, Settings, Timing

NOTIFICATION_BYTES: Final = 20
"""What one BLE notification or write carries at the smallest MTU, 23 bytes less 3 of its own."""
INTERVAL: Final = 0.030
"""Seconds between connection events where only their size is set."""
PER_EVENT: Final = 4
"""Packets per event and direction where only the interval is set."""
BITS_PER_BYTE: Final = 10
"""Of a UART: a start bit, eight data bits and a stop bit."""
LONGEST_HOLD: Final = 0.050
"""Seconds that an answer waits at most for the next one to overtake it."""


class _Held(NamedTuple):
    frame: bytes
    until: float


class Radio:
    """A connection with faults that depend on the seed alone; packets stay in order, unless reordered.

    Faults hit whole packets, one write of the host or one frame of the robot, before a frame is cut up: how
    many survive does not depend on ``split``.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._up = Random(f"{settings.seed} up")
        self._down = Random(f"{settings.seed} down")
        self._order = Random(f"{settings.seed} order")
        interval, per_event = settings.interval, settings.per_event or PER_EVENT
        if interval is None and settings.per_event is not None:
            interval = INTERVAL
        is_ble = settings.line is Line.BLE
        is_measured = settings.timing is Timing.MEASURED
        size = settings.split or (SPLIT if is_measured else NOTIFICATION_BYTES if is_ble else None)
        packet = None if interval is None else NOTIFICATION_BYTES
        per_byte = BITS_PER_BYTE / settings.baud if settings.baud else 0.0
        self._to_robot = Channel(packet, interval, per_event, seconds_per_byte=per_byte)
        self._to_host = Channel(size, interval, per_event, seconds_per_byte=per_byte)
        self._timing = Random(f"{settings.seed} timing") if is_measured else None
        self._held: _Held | None = None
        self._begun = False

    def begin(self, *, now: float) -> None:
        """Start the connection events if they do not run yet; the time was unknown before."""
        if not self._begun:
            self.connect(now=now)

    def connect(self, *, now: float) -> None:
        """Begin a new connection: nothing is on its way, and events are counted from ``now``."""
        self._begun = True
        self._held = None
        self._to_robot.begin(now=now)
        self._to_host.begin(now=now)

    def drop(self, *, now: float) -> None:
        """Lose all that is on its way; what has arrived at the host can still be received."""
        self._held = None
        self._to_robot.begin(now=now)
        self._to_host.cut_off(now=now)

    def carry(self, data: bytes, *, now: float) -> None:
        """Send one write of the host."""
        self._to_robot.put(self._spoil(data, self._up), ready=now)

    @property
    def due(self) -> float | None:
        """When the next bytes reach the robot."""
        return self._to_robot.due

    def take(self) -> bytes:
        """Return the next bytes for the robot; there must be some."""
        return self._to_robot.take()

    def send(self, frame: bytes, *, now: float, is_answer: bool = False) -> None:
        """Send a frame of the robot; ``now`` in seconds of the caller's clock."""
        self._release(now)
        if not is_answer:
            self._launch(frame, now)
        elif self._held:
            self._launch(frame, now)
            self._release(now, overtaken=True)
        elif self._settings.reorder and self._order.random() < self._settings.reorder:
            self._held = _Held(frame, now + LONGEST_HOLD)
        else:
            self._launch(frame, now)

    def receive(self, *, now: float) -> list[bytes]:
        """Return the notifications that have arrived by ``now``, in order."""
        self._release(now)
        arrived = []
        while self._to_host.due is not None and self._to_host.due <= now:
            arrived.append(self._to_host.take())
        return arrived

    def next_time(self) -> float | None:
        """Return when the next packet arrives or is released, None while none is on its way."""
        times = (self._to_robot.due, self._to_host.due, self._held.until if self._held else None)
        return min((time for time in times if time is not None), default=None)

    def _release(self, now: float, *, overtaken: bool = False) -> None:
        """Send the held answer if it was overtaken, or has waited long enough."""
        held = self._held
        if held and (overtaken or held.until <= now):
            self._held = None
            self._launch(held.frame, now if overtaken else held.until)

    def _launch(self, frame: bytes, now: float) -> None:
        ready = now + self._settings.latency
        if self._timing:
            ready += round_trip(self._timing)
        copies = 2 if self._settings.duplicate and self._down.random() < self._settings.duplicate else 1
        for _ in range(copies):
            self._to_host.put(self._spoil(frame, self._down), ready=ready)

    def _spoil(self, data: bytes, chance: Random) -> bytes:
        """Lose a packet, or change one byte of it."""
        if self._settings.loss and chance.random() < self._settings.loss:
            return b""
        if data and self._settings.corrupt and chance.random() < self._settings.corrupt:
            at = chance.randrange(len(data))
            return data[:at] + bytes((data[at] ^ chance.randrange(1, 0x100),)) + data[at + 1 :]
        return data
