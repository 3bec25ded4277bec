"""Measure how long a robot takes to answer, with echoes sent one at a time."""

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
"""Measuring ends after this many lost echoes in a row."""
_MOST: Final = 0.95


class RoundTrips(NamedTuple):
    """Round trips of echoes.

    Attributes:
        sent: echoes that were sent.
        times: round trips of the answered ones, in seconds, shortest first.
    """

    sent: int
    times: tuple[float, ...]

    @property
    def lost(self) -> int:
        """Echoes that were not answered in time."""
        return self.sent - len(self.times)

    @property
    def median(self) -> float:
        """Median round trip in seconds; NaN if there is none."""
        return median(self.times) if self.times else math.nan

    @property
    def p95(self) -> float:
        """95th percentile of the round trips in seconds, by nearest rank; NaN if there is none."""
        return self.times[math.ceil(_MOST * len(self.times)) - 1] if self.times else math.nan


async def measure_round_trips(link: Link, target: int | None, count: int = ECHOES) -> RoundTrips:
    """Send echoes one after the other; stop early if none is answered any more.

    Args:
        link: to a robot that is awake.
        target: the node that answers, None for a robot without nodes.
        count: how many echoes.

    Raises:
        LinkLostError: the link was lost.
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
