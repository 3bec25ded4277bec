"""A probe on its way: prepared once before it is sent, and how sending it ended."""

from typing import NamedTuple

from sphero_probe.catalogue.model import CommandRow
from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Exchange
from sphero_probe.protocol.packets import Command


class PreparedProbe(NamedTuple):
    """A probe made ready.

    Attributes:
        number: its place in the run, from 1.
        command: with node and payload filled in.
        risk: the class of sending it.
        knowledge: the catalogue's row for this robot, None where there is none.
        blocked: why it must not be sent, empty when it may.
        is_last_try: it gets the whole timeout, whatever is answered meanwhile.
        is_wrong_length: it is harmless only if the command refuses its length.
        may_exist: the catalogue or the robot's own list names the command: a wrong length may reach it.
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
        """Whether an answer is sure to come: it is a documented query."""
        return self.knowledge is not None and self.knowledge.risk is Risk.READ and self.risk is Risk.READ


class ProbeResult(NamedTuple):
    """How asking a probe ended, and how often it went out for that."""

    exchange: Exchange
    attempts: int
