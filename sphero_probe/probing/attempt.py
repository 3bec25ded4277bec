"""A probe that is ready to be sent, and its result, as values."""

from collections.abc import Awaitable, Callable
from typing import NamedTuple

from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Exchange
from sphero_probe.protocol.packets import Command


class PreparedProbe(NamedTuple):
    """A probe that is ready to be sent.

    Attributes:
        number: its place in the run, from 1.
        command: with node and payload filled in.
        risk: the class of sending it.
        knowledge: the catalogue's row for this robot, None if there is none.
        blocked: why the policy blocks it, empty when it may be sent.
        wait_until: when it may count as silent at the earliest, on the event loop's clock, though a later
            command is answered before.
        is_wrong_length: it is harmless only if the command rejects its length.
        may_exist: the catalogue or the robot's own list has the command, so a wrong length may reach it.
        was_silent: an earlier attempt got no answer.
    """

    number: int
    command: Command
    risk: Risk
    knowledge: CommandRow | None
    blocked: str
    wait_until: float = 0.0
    is_wrong_length: bool = False
    may_exist: bool = False
    was_silent: bool = False


Announce = Callable[[PreparedProbe], Awaitable[None]]
"""Waits until the intent to send a probe is recorded where the death of this process cannot undo it.

It is awaited before a probe above the class ``probe`` is sent, where another process keeps the record.
"""


class ProbeResult(NamedTuple):
    """How a probe ended, and how often it was sent."""

    exchange: Exchange
    attempts: int
