"""The results of calibration, as values: how a node and its devices treat lengths, with the evidence."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.link.wrong_lengths import WRONG_LENGTH
from sphero_probe.protocol.packets import Command, Verdict

GONE: Final = (Verdict.NO_DEVICE, Verdict.NO_COMMAND)
"""How a robot answers a command that it does not have."""
ACCEPTED: Final = (Verdict.OK, Verdict.FAILED, Verdict.BAD_VALUE)
"""How a command answers a length that it accepts: it was executed, or was about to be."""


class Strictness(StrEnum):
    """How a node treats a length that a command does not take."""

    STRICT = "strict"
    """It rejects it with "bad length", but only if the command exists."""
    MASKING = "masking"
    """It rejects it with "bad length" even if the command does not exist: that answer proves nothing."""
    LENIENT = "lenient"
    """A command accepted a wrong length: wrong-length probing is off."""
    NO_NODE = "no such node"
    """It answers every read with "bad target id": there is nothing that could execute a command."""
    UNKNOWN = "unknown"
    """It could not be measured: wrong-length probing is off."""


class Step(NamedTuple):
    """One calibration probe and its answer.

    Attributes:
        command: the command that was sent.
        wanted: how a strict node answers.
        said: how this node answered, in words.
    """

    command: Command
    wanted: str
    said: str


class Answer(NamedTuple):
    """The parts of an answer that can be compared with those of another.

    Attributes:
        code: the error code.
        payload: the data bytes.
    """

    code: int
    payload: bytes


class NodeProfile(NamedTuple):
    """What calibration found on one node.

    Attributes:
        target: the node's address byte, None if the robot takes no addresses.
        strictness: the conclusion.
        why: one line.
        steps: the evidence.
        absent: a command that the node called absent, None if there is none.
        executed: a command above the class ``read`` that accepted a wrong length; None if none did.
        is_mute: it answered nothing, not even an echo.
    """

    target: int | None
    strictness: Strictness
    why: str
    steps: tuple[Step, ...]
    absent: Command | None = None
    executed: Command | None = None
    is_mute: bool = False


class DeviceProfile(NamedTuple):
    """What calibration found in one device of a node.

    Attributes:
        target: the node's address byte, None if the robot takes no addresses.
        did: the device id.
        exists: whether the node has the device, as far as its answers tell.
        asked: how many existing documented commands got a wrong length.
        rejected: how many of them rejected it as such.
        impossible: payload length -> the answer to a command that cannot exist, None for silence.
        steps: the evidence.
        executed: a command above the class ``read`` that accepted a wrong length; None if none did.
        claimed: command ids that the robot lists for the device.
    """

    target: int | None
    did: int
    exists: bool
    asked: int
    rejected: int
    impossible: Mapping[int, Answer | None]
    steps: tuple[Step, ...]
    executed: Command | None = None
    claimed: frozenset[int] = frozenset()

    @property
    def knows_impossible(self) -> bool:
        """Whether the answer to a command that cannot exist was measured."""
        return WRONG_LENGTH in self.impossible

    def to_impossible(self, length: int) -> Answer | None:
        """Return the answer to a command that cannot exist, None for silence.

        Args:
            length: of the payload. All lengths but 0 count as the wrong length of a probe; so does 0 if the
                empty payload was not sent.
        """
        wrong = self.impossible.get(WRONG_LENGTH)
        return self.impossible.get(0, wrong) if length == 0 else wrong
