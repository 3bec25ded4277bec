"""Packets as values: what a packet says, independent of the generation that carries it."""

from enum import Enum, StrEnum
from typing import Final, NamedTuple


class Generation(StrEnum):
    """The two binary protocols of Sphero robots."""

    V1 = "v1"
    V2 = "v2"

    # That of an enumeration is written in Python, and every look-up of a codec needs it.
    __hash__ = str.__hash__


class Role(Enum):
    """Whose traffic a decoder reads; a command and a notification can have the same bytes."""

    HOST = "host"
    """Reads what a robot sends."""
    ROBOT = "robot"
    """Reads what a host sends."""
    OBSERVER = "observer"
    """Reads both directions at once, as in a capture: it tells the kinds of packets apart by their bytes."""


class Verdict(Enum):
    """What a response code says about a command, in terms that both generations share."""

    OK = "ok"
    NO_DEVICE = "no such device id"
    NO_COMMAND = "no such command id"
    NOT_IMPLEMENTED = "exists, not implemented"
    RESTRICTED = "exists, restricted"
    BAD_LENGTH = "exists, length refused"
    FAILED = "exists, ran and failed"
    BAD_VALUE = "exists, value refused"
    BUSY = "busy"
    NO_TARGET = "no such node"
    TARGET_UNAVAILABLE = "node asleep or disconnected"
    DAMAGED = "the robot received a damaged packet"
    UNLISTED = "a code in no document"


class SendOptions(NamedTuple):
    """The flags and the source address that a command is sent with; the defaults suit nearly always.

    Attributes:
        answer: ask for a response.
        only_errors: ask for a response only if the command fails; V2 only.
        activity: reset the robot's sleep timer.
        source: address byte of who asks, None for the usual one; V2 only.
        without_source: leave the source address out beside a target, as the official SDK does; V2 only.
    """

    answer: bool = True
    only_errors: bool = False
    activity: bool = True
    source: int | None = None
    without_source: bool = False

    @property
    def wants_answer(self) -> bool:
        """Whether an answer is due to the command whatever becomes of it."""
        return self.answer and not self.only_errors


USUAL: Final = SendOptions()
"""How a command is sent where nothing else is said."""


class Command(NamedTuple):
    """A command, independent of how it is sent.

    Attributes:
        did: device id, 0-255.
        cid: command id, 0-255.
        payload: the argument bytes.
        target: byte of the node's ``Address``, or None to leave addresses out.
        options: its flags and its source. Those of a command that a decoder read stand in its ``Request``.
    """

    did: int
    cid: int
    payload: bytes = b""
    target: int | None = None
    options: SendOptions = USUAL


class Request(NamedTuple):
    """A command as a robot receives it.

    Attributes:
        command: the command.
        seq: the sequence number that the response repeats, 0-255.
        source: address byte of the sender, None where absent.
        flags: the raw flag byte(s), first byte lowest; meaning depends on the generation.
        wants_answer: the sender expects a response, whatever its code.
    """

    command: Command
    seq: int
    source: int | None = None
    flags: int = 0
    wants_answer: bool = True


class Response(NamedTuple):
    """The response to a command.

    Attributes:
        seq: the sequence number of the request, 0-255.
        code: the response code, 0-255; ``Codec.verdict`` says what it means.
        payload: the data bytes.
        did: device id, None in V1, which does not send it back.
        cid: command id, None in V1.
        source: address byte of the node that answered, None where absent.
        target: address byte of the node that the response is for, None where absent.
        flags: the raw flag byte(s).
    """

    seq: int
    code: int
    payload: bytes = b""
    did: int | None = None
    cid: int | None = None
    source: int | None = None
    target: int | None = None
    flags: int = 0


class Notification(NamedTuple):
    """A message that a robot sends without a request.

    Attributes:
        did: device id; None in V1, whose async id is in ``cid``.
        cid: command id, or the V1 async id.
        payload: the data bytes.
        source: address byte of the node that sent it, None where absent.
        target: address byte of the receiver, None where absent.
        seq: the sequence byte, 0xFF in every capture; None where the generation has none.
        flags: the raw flag byte(s).
    """

    did: int | None
    cid: int
    payload: bytes = b""
    source: int | None = None
    target: int | None = None
    seq: int | None = None
    flags: int = 0


class Malformed(NamedTuple):
    """Bytes that are not a valid packet. They are returned as data; no decoder raises on them.

    Attributes:
        raw: the bytes as received.
        reason: what is wrong with them, as text.
    """

    raw: bytes
    reason: str


Packet = Request | Response | Notification | Malformed
