"""The commands of a link that wait to be sent, and those in flight, as values."""

import asyncio
from typing import NamedTuple

from sphero_probe.link.exchange import Exchange
from sphero_probe.protocol.packets import Command


class QueuedCommand(NamedTuple):
    """A command that waits for a place in the window.

    Attributes:
        command: what to send.
        timeout: seconds until it counts as silent, None for the node's pace.
        alone: send it with nothing else in flight.
        expected: an answer is certain.
    """

    command: Command
    timeout: float | None
    alone: bool
    expected: bool


class InFlightCommand(NamedTuple):
    """A command that has a place in the window.

    Attributes:
        seq: its sequence number.
        frame: the bytes to send.
        queued: the command and how to send it.
        answer: resolves to how it ended.
    """

    seq: int
    frame: bytes
    queued: QueuedCommand
    answer: asyncio.Future[Exchange]

    @property
    def is_paced(self) -> bool:
        """Whether its timeout is that of the node's pace."""
        return self.queued.timeout is None
