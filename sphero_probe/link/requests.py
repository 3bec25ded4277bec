"""What stands in line for a robot, and what has got a place in the window, as values for a link."""

import asyncio
from typing import NamedTuple

from sphero_probe.link.exchange import Exchange
from sphero_probe.protocol.packets import Command


class QueuedCommand(NamedTuple):
    """What somebody wants asked, and how.

    Attributes:
        command: what to ask.
        timeout: seconds until it counts as silent, None for the node's pace.
        alone: with nothing else in flight.
        expected: an answer is sure to come.
    """

    command: Command
    timeout: float | None
    alone: bool
    expected: bool


class InFlightCommand(NamedTuple):
    """A place in the window.

    Attributes:
        seq: the sequence number that goes with it.
        frame: what to send.
        queued: whose place it is.
        answer: where the answer will be.
    """

    seq: int
    frame: bytes
    queued: QueuedCommand
    answer: asyncio.Future[Exchange]

    @property
    def is_paced(self) -> bool:
        """Whether nobody named a timeout for it."""
        return self.queued.timeout is None
