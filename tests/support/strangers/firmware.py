"""The parts of a stranger: ``Firmware`` has its commands and checks, ``Voice`` changes its responses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum, auto
from typing import TYPE_CHECKING, NamedTuple

from tests.support.strangers.commands import Row
from tests.support.strangers.frames import Answer, Request

if TYPE_CHECKING:
    from tests.support.strangers.robot import Robot

Claims = dict[int, list[int]]
"""What a node says it has: device id -> command ids."""


class Code(IntEnum):
    """What is answered, in the numbers of the newer protocol; the older one's are in ``OLDER``."""

    SUCCESS = 0x00
    NO_DEVICE = 0x01
    NO_COMMAND = 0x02
    STUB = 0x03
    RESTRICTED = 0x04
    BAD_LENGTH = 0x05
    FAILED = 0x06
    BAD_VALUE = 0x07
    BUSY = 0x08
    NO_NODE = 0x09
    UNAVAILABLE = 0x0A


OLDER = {
    Code.NO_DEVICE: 0x09,
    Code.NO_COMMAND: 0x04,
    Code.STUB: 0x05,
    Code.BAD_LENGTH: 0x06,
    Code.BAD_VALUE: 0x07,
    Code.FAILED: 0x01,
    Code.BUSY: 0x0A,
}


class Check(Enum):
    """How a handler treats a number of argument bytes that it does not want."""

    EXACT = auto()
    SURPLUS_IGNORED = auto()
    SHORT_ACCEPTED = auto()
    NONE = auto()
    AFTERWARDS = auto()
    """It runs first, and then says that the length was wrong."""


class Nothing(Enum):
    """Instead of a code: no response."""

    SAID = auto()


Word = Code | Nothing | None


class Moment(NamedTuple):
    """A request as it arrives.

    Attributes:
        robot: which heard it.
        request: what it heard.
        node: for which of its nodes.
        now: seconds.
        number: how many requests the robot heard by now, this one counted.
        attempt: how often it heard this very one by now.
    """

    robot: "Robot"
    request: Request
    node: int
    now: float
    number: int
    attempt: int

    @property
    def pair(self) -> tuple[int, int]:
        return self.request.did, self.request.cid


def _exact(_: Row) -> Check:
    return Check.EXACT


def _never(*_: object) -> bool:
    return False


def _no_command(_node: int, _did: int) -> Word:
    return Code.NO_COMMAND


def _no_mood(_: Moment) -> Word:
    return None


def honest(rows: Sequence[Row], node: int) -> Claims:
    """Return all that a node has."""
    claims: Claims = {}
    for row in sorted(rows):
        if row.node == node:
            claims.setdefault(row.did, []).append(row.cid)
    return claims


@dataclass(frozen=True, kw_only=True)
class Firmware:
    """What exists and how requests are checked.

    Attributes:
        rows: every command there is.
        older: whether it speaks the older protocol.
        check: how one command checks lengths.
        masks: whether this node and device refuse that many bytes before they look for the command.
        impossible: what this node says of a command that this device does not have.
        no_device: what is said of a device that is not there.
        value_first: values are looked at before the length.
        mood: a response that replaces all of that, or None.
        claims: what a node says it has.
    """

    rows: tuple[Row, ...]
    older: bool = False
    check: Callable[[Row], Check] = _exact
    masks: Callable[[int, int, int], bool] = _never
    impossible: Callable[[int, int], Word] = _no_command
    no_device: Word = Code.NO_DEVICE
    value_first: bool = False
    mood: Callable[[Moment], Word] = _no_mood
    claims: Callable[[Sequence[Row], int], Claims] = honest


def _on_time(_: Moment) -> float:
    return 0.0


def _as_it_is(answer: Answer, _: Moment) -> Answer | None:
    return answer


def _whole(frame: bytes, _: Moment) -> Sequence[bytes]:
    return [frame]


@dataclass(frozen=True, kw_only=True)
class Voice:
    """What happens to an answer.

    Attributes:
        latency: seconds until it is with the host.
        service: seconds that the robot works on each request, one after the other.
        late: seconds more, for this one.
        alter: what is said instead; None for nothing.
        pieces: the bytes of a frame as they arrive: cut, damaged, twice.
        escape: whether special bytes are escaped.
        flood: notifications a second.
        queue: requests that may wait; more are lost.
        drops: whether this request makes the robot drop the line and start again.
    """

    latency: float = 0.02
    service: float = 0.002
    late: Callable[[Moment], float] = _on_time
    alter: Callable[[Answer, Moment], Answer | None] = _as_it_is
    pieces: Callable[[bytes, Moment], Sequence[bytes]] = _whole
    escape: bool = True
    flood: int = 0
    queue: int = 64
    drops: Callable[[Moment], bool] = _never
