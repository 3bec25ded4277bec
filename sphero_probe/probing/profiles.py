"""What calibration measured, as values: how a node and its devices treat lengths, with the evidence."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.link.policy import WRONG_LENGTH
from sphero_probe.protocol.packets import Command, Verdict

GONE: Final = (Verdict.NO_DEVICE, Verdict.NO_COMMAND)
"""What a robot says of a pair that it does not have."""
ACCEPTED: Final = (Verdict.OK, Verdict.FAILED, Verdict.BAD_VALUE)
"""What a command says that took the length it got: it ran, or it was about to."""


class Strictness(StrEnum):
    """How a node treats a length that a command does not take."""

    STRICT = "strict"
    """Refused with "bad length", only where the command exists."""
    MASKING = "masking"
    """Refused with "bad length" even where no command exists: that answer proves nothing."""
    LENIENT = "lenient"
    """A command accepted a wrong length: wrong-length probing is off."""
    NO_NODE = "no such node"
    """Every read is answered with "bad target id": nothing is there that could execute anything."""
    UNKNOWN = "unknown"
    """It could not be measured: wrong-length probing is off."""


class Step(NamedTuple):
    """One calibration probe and its answer.

    Attributes:
        command: what was asked.
        wanted: what a strict node answers.
        said: what this node answered, in words.
    """

    command: Command
    wanted: str
    said: str


class Answer(NamedTuple):
    """An answer, as far as it can be compared with another one.

    Attributes:
        code: the error code.
        payload: the data bytes.
    """

    code: int
    payload: bytes


class NodeProfile(NamedTuple):
    """What calibration found on one node.

    Attributes:
        target: the node's address byte, None where addresses are left out.
        strictness: the conclusion.
        why: one line.
        steps: the evidence.
        absent: a pair that the node called absent, None where it called none so.
        executed: a command above the class ``read`` that accepted a wrong length; None where none did.
    """

    target: int | None
    strictness: Strictness
    why: str
    steps: tuple[Step, ...]
    absent: Command | None = None
    executed: Command | None = None


class DeviceProfile(NamedTuple):
    """What calibration found in one device of a node.

    Attributes:
        target: the node's address byte, None where addresses are left out.
        did: the device id.
        exists: whether the node has the device, as far as its answers tell.
        asked: existing documented commands that got a wrong length.
        refused: how many of them refused it as such.
        impossible: payload length -> the answer to a command that cannot exist, None for silence.
        steps: the evidence.
        executed: a command above the class ``read`` that accepted a wrong length; None where none did.
        claimed: command ids that the robot lists for the device.
    """

    target: int | None
    did: int
    exists: bool
    asked: int
    refused: int
    impossible: Mapping[int, Answer | None]
    steps: tuple[Step, ...]
    executed: Command | None = None
    claimed: frozenset[int] = frozenset()

    @property
    def knows_impossible(self) -> bool:
        """Whether it was measured what a command that cannot exist answers."""
        return WRONG_LENGTH in self.impossible

    def to_impossible(self, length: int) -> Answer | None:
        """Return the answer to a command that cannot exist, None for silence.

        Args:
            length: of the payload; any but 0 is compared with the wrong length of a probe. Where the empty
                payload was not sent, the wrong length stands for it.
        """
        wrong = self.impossible.get(WRONG_LENGTH)
        return self.impossible.get(0, wrong) if length == 0 else wrong
