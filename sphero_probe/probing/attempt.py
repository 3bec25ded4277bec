"""A probe that is ready to be sent, and its result, as values."""

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
        is_last_try: it gets the whole timeout, even if later commands are answered meanwhile.
        is_wrong_length: it is harmless only if the command rejects its length.
        may_exist: the catalogue or the robot's own list has the command, so a wrong length may reach it.
    """

    number: int
    command: Command
    risk: Risk
    knowledge: CommandRow | None
    blocked: str
    is_last_try: bool = False
    is_wrong_length: bool = False
    may_exist: bool = False

    @property
    def is_expected(self) -> bool:
        """Whether an answer is certain, because it is a documented query."""
        return self.knowledge is not None and self.knowledge.risk is Risk.READ and self.risk is Risk.READ


class ProbeResult(NamedTuple):
    """How a probe ended, and how often it was sent."""

    exchange: Exchange
    attempts: int
