"""The streaming services of a fake RVR: their deliveries, and the values of its sensors."""

from random import Random
from typing import Final

from sphero_probe.catalogue.streaming_services import DELIVER, SERVICES, Channel, Slot, raw_of
from sphero_probe.simulator.streaming import AT_REST, BACKLOG

_RANGES: Final[dict[str, tuple[float, float]]] = {
    "ambient_light": (90.0, 110.0),
    "red": (20.0, 200.0),
    "green": (20.0, 200.0),
    "blue": (20.0, 200.0),
    "color_confidence": (0.5, 1.0),
    "encoder_left": (0.0, 5000.0),
    "encoder_right": (0.0, 5000.0),
}
"""Range of a reading where a mask stream has no such sensor."""
_CLOCK: Final = ("core_time_upper", "core_time_lower")


def steady_readings(seed: int) -> dict[str, float]:
    """Return the value of every sensor of a resting robot by name; the clock is not among them."""
    return {
        channel.name: _reading(channel, Random(f"{seed} {channel.name}"))
        for service in SERVICES.values()
        for channel in service.channels
        if channel.name not in _CLOCK
    }


class ServiceStream:
    """The deliveries of one token of one node.

    Attributes:
        node: the processor they come from.
        pair: (did, cid) of the notifications.
        due: when the next one is sent, in seconds of the caller's clock.
    """

    pair: tuple[int | None, int] = DELIVER

    def __init__(
        self,
        node: int,
        token: int,
        slots: tuple[Slot, ...],
        readings: dict[str, float],
        *,
        period: float,
        now: float,
    ) -> None:
        """Take what was configured, the values to send, and the seconds between deliveries."""
        self.node = node
        self._token = token
        self._slots = slots
        self._readings = readings
        self._period = period
        self.due: float | None = now + period

    def sample(self, *, now: float) -> tuple[float, bytes] | None:
        """Return when the next delivery was due and its payload; None while nothing is due by ``now``."""
        if self.due is None or self.due > now:
            return None
        sent = max(self.due, now - BACKLOG * self._period)
        self.due = sent + self._period
        clock = int(sent * 1000)
        readings = self._readings | dict(zip(_CLOCK, (clock >> 32, clock & 0xFFFF_FFFF), strict=True))
        values = (
            raw_of(channel, readings[channel.name], bits).to_bytes(bits // 8, "big")
            for service, bits in self._slots
            for channel in service.channels
        )
        return sent, bytes([self._token]) + b"".join(values)


def _reading(channel: Channel, chance: Random) -> float:
    value = chance.uniform(*(AT_REST.get(channel.name) or _RANGES.get(channel.name, (0.0, 0.0))))
    return round(value) if channel.whole else round(value, 3)
