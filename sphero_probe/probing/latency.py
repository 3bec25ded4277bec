"""A link comes in, how long a robot takes to answer comes out: echoes, one in flight."""

import math
from statistics import median
from typing import Final, NamedTuple

from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.link.exchange import Answered
from sphero_probe.link.link import Link
from sphero_probe.protocol.packets import Command

ECHOES: Final = 40
"""Echoes of one measurement."""
_GIVEN_UP: Final = 5
"""Echoes lost in a row after which no more are sent."""
_MOST: Final = 0.95


class RoundTrips(NamedTuple):
    """Round trips of echoes.

    Attributes:
        sent: echoes that went out.
        times: of those that came back, in seconds, shortest first.
    """

    sent: int
    times: tuple[float, ...]

    @property
    def lost(self) -> int:
        """Echoes that did not come back in time."""
        return self.sent - len(self.times)

    @property
    def median(self) -> float:
        """Seconds that half of the round trips take at most; NaN where there is none."""
        return median(self.times) if self.times else math.nan

    @property
    def p95(self) -> float:
        """Seconds that 95 of 100 round trips take at most, by the nearest rank; NaN where there is none."""
        return self.times[math.ceil(_MOST * len(self.times)) - 1] if self.times else math.nan


async def measure_round_trips(link: Link, target: int | None, count: int = ECHOES) -> RoundTrips:
    """Send echoes, each after the last has come back or is lost; a dead line is given up early.

    Args:
        link: to a robot that is awake.
        target: the node that answers, None for a robot without nodes.
        count: how many echoes.

    Raises:
        LinkLostError: the robot is gone.
    """
    row = row_for(link.codec.generation, WellKnown.ECHO)
    if row is None:
        return RoundTrips(0, ())
    command = Command(row.did, row.cid, b"", target)
    times: list[float] = []
    sent = in_a_row = 0
    while sent < count and in_a_row < _GIVEN_UP:
        exchange = await link.ask(command, alone=True)
        sent += 1
        if isinstance(exchange, Answered):
            times.append(exchange.rtt)
            in_a_row = 0
        else:
            in_a_row += 1
    return RoundTrips(sent, tuple(sorted(times)))
