"""The commands of a link that wait to be sent, and those in flight, as values."""

import asyncio
from math import inf
from typing import NamedTuple

from sphero_probe.link.exchange import Exchange
from sphero_probe.protocol.packets import Command


class QueuedCommand(NamedTuple):
    """A command that waits for a place in the window.

    Attributes:
        command: what to send.
        timeout: seconds until it counts as silent, None for the node's pace.
        alone: send it with nothing else in flight.
        expected: whether an answer is certain, False where silence is likely, None where nothing is known.
        patience: seconds that it waits at least, though a later command was answered meanwhile.
    """

    command: Command
    timeout: float | None
    alone: bool
    expected: bool | None
    patience: float = 0.0


class InFlightCommand(NamedTuple):
    """A command that has a place in the window.

    Attributes:
        seq: its sequence number.
        frame: the bytes to send.
        queued: the command and how to send it.
        answer: resolves to how it ended.
        sent_at: when it got its place.
    """

    seq: int
    frame: bytes
    queued: QueuedCommand
    answer: asyncio.Future[Exchange]
    sent_at: float

    def deadline_when_overtaken(self, soonest: float) -> float:
        """Return until when it waits once a later command was answered.

        Args:
            soonest: the time until which it waits for an answer that was only overtaken.
        """
        return inf if self.queued.timeout is not None else max(soonest, self.sent_at + self.queued.patience)
