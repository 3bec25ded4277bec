"""How long a real robot takes to answer: round trips of a Sphero Mini, measured and not assumed.

The figures are quantiles of 881 answers to the maker's app in a public Android capture. The robot answered in
order and sent almost byte by byte. The app had at most two commands in flight. So the capture does not show
how many more the robot takes.
"""

from random import Random
from typing import Final

ROUND_TRIPS: Final = ((0.0, 0.0183), (0.1, 0.0247), (0.5, 0.0388), (0.9, 0.0530), (1.0, 0.0710))
"""Share of the answers, and the seconds in which they arrived; the slowest one in a hundred is left out."""
SPLIT: Final = 1
"""Bytes per notification."""
IN_FLIGHT: Final = 2
"""The most commands that were in flight."""


def round_trip(chance: Random) -> float:
    """Return the seconds from a command to its answer, drawn from the measured ones."""
    share = chance.random()
    upper = next(place for place, (above, _) in enumerate(ROUND_TRIPS) if share <= above and place)
    (below, fast), (above, slow) = ROUND_TRIPS[upper - 1 : upper + 1]
    return fast + (slow - fast) * (share - below) / (above - below)
