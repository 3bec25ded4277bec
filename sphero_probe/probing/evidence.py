"""What an evidence run collects, as values: everything that was asked, and how the robot answered.

The values hold no time of day, no name and no address of a robot; what its answers hold beyond the known
layouts is replaced before it is shared (``runs.evidence``).
"""

from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.robots import ROBOTS
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.codec import Codec
from sphero_probe.protocol.packets import Command, Generation

WINDOWS: Final = (1, 2, 4, 8, 16)
"""Echoes that are sent at once, burst by burst."""
ECHO_SIZES: Final = (0, 1, 2, 4, 8, 12, 16, 17, 24, 32, 48, 64, 96, 128)
"""Bytes of the echoes that look for the largest payload; 16 is the documented limit [vendor]."""


class Topic(StrEnum):
    """A part of an evidence run."""

    CALIBRATION = "calibration"
    ORDER = "order of checks"
    LISTS = "own lists"
    CODES = "codes on demand"
    NODES = "nodes"
    SIZES = "echo sizes"
    BURSTS = "echo bursts"
    IDLE = "idle"


class Ending(StrEnum):
    """How asking one command ended."""

    ANSWERED = "answered"
    SILENT = "silent"
    BLOCKED = "blocked"


class Replaced(NamedTuple):
    """Stands for bytes that are not shared.

    Attributes:
        length: how many there were.
        digest: the same for the same bytes within one file, and of no use outside it.
    """

    length: int
    digest: str


class Asked(NamedTuple):
    """One command and how asking it ended.

    Attributes:
        topic: the part of the run.
        command: with payload and node; without its options.
        flags: the flag byte(s) of the frame that was sent, None if none was sent.
        ending: how it ended.
        code: of the answer, None without one.
        data: of the answer; empty without one.
        source: address byte of the node that answered, None if the answer names none.
        client: address byte of the receiver in the answer, None if the answer names none.
        milliseconds: the round trip, None without an answer.
    """

    topic: Topic
    command: Command
    flags: int | None
    ending: Ending
    code: int | None = None
    data: bytes | Replaced = b""
    source: int | None = None
    client: int | None = None
    milliseconds: float | None = None


class Burst(NamedTuple):
    """Echoes that were sent at once, to a node that had nothing else to do.

    Attributes:
        sent: how many.
        answered: how many came back.
        busy: how many were answered with "busy".
        in_order: whether the answers came in the order of the commands.
        milliseconds: the round trips of the echoes that came back, in the order of the answers.
    """

    sent: int
    answered: int
    busy: int
    in_order: bool
    milliseconds: tuple[float, ...]


class Heard(NamedTuple):
    """A notification while nothing was sent.

    Attributes:
        did: device id, None in V1.
        cid: command id, in V1 the id of the message.
        after: seconds since the last command.
    """

    did: int | None
    cid: int
    after: float


class Idle(NamedTuple):
    """A time in which nothing was sent.

    Attributes:
        seconds: how long it was.
        heard: the first notifications in it.
        dropped: the link was lost in it.
        awake: whether the robot answered an echo afterwards; None if it was not asked.
    """

    seconds: float
    heard: tuple[Heard, ...]
    dropped: bool
    awake: bool | None


class MeasuredNode(NamedTuple):
    """What calibration found on one node.

    Attributes:
        target: the node's address byte, None if the robot takes no addresses.
        strictness: a word of ``profiles.Strictness``.
        why: one line.
    """

    target: int | None
    strictness: str
    why: str


class Evidence(NamedTuple):
    """Everything that one evidence run found.

    Attributes:
        tool_version: of sphero-probe.
        robot: the model's key, empty if it is not known.
        generation: its protocol.
        line: how it was reached: ``ble``, ``serial``, ``rfcomm``, ``fake``, ``replay``.
        firmware: node name -> version, for the nodes that answered.
        write_size: bytes that one write carries at most, None where the line sets no limit.
        chunks: bytes that arrived at once -> how often.
        nodes: what calibration found.
        asked: every command, in the order in which they ended.
        bursts: echoes at once.
        idle: a time without commands, None if there was none.
        surprises: commands that accepted a wrong length, and were executed.
        complete: whether everything was asked.
        frames_sent: command frames sent.
        seconds: how long it took.
    """

    tool_version: str
    robot: str
    generation: Generation
    line: str
    firmware: Mapping[str, str]
    write_size: int | None
    chunks: Mapping[int, int]
    nodes: tuple[MeasuredNode, ...]
    asked: tuple[Asked, ...]
    bursts: tuple[Burst, ...]
    idle: Idle | None
    surprises: tuple[Command, ...]
    complete: bool
    frames_sent: int
    seconds: float

    @property
    def problem(self) -> str:
        """Why part of the evidence is missing, empty if none is."""
        if not self.complete:
            return "the evidence is incomplete: the run ended early"
        if self.surprises:
            return "a wrong length was executed, so its node got no further wrong length"
        return ""

    @property
    def is_simulated(self) -> bool:
        """Whether no real robot answered, but the built-in one or a recording."""
        return self.line in ("fake", "replay")

    @property
    def model(self) -> Robot | None:
        """The robot's model, None if it is not known."""
        return ROBOTS.get(self.robot)

    @property
    def codec(self) -> Codec:
        """The codec of the robot's protocol."""
        return CODECS[self.generation]

    def firmware_of(self, node: str) -> str:
        """Return the version of a node by its name; of a robot of an unknown model, its only version."""
        versions = list(self.firmware.values())
        alone = versions[0] if len(versions) == len(self.nodes) == 1 else "not told"
        return self.firmware.get(node, alone)

    @property
    def answers(self) -> Iterator[Asked]:
        """The commands that were answered; each has a code."""
        return (one for one in self.asked if one.ending is Ending.ANSWERED and one.code is not None)
