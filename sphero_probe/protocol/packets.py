"""The values that every layer speaks in: what a packet says, whatever generation carried it."""

from enum import Enum, StrEnum
from typing import NamedTuple


class Generation(StrEnum):
    """The two binary protocols of Sphero robots."""

    V1 = "v1"
    V2 = "v2"


class Role(Enum):
    """Which end of the line a decoder listens at: a command and a notification can look alike."""

    HOST = "host"
    ROBOT = "robot"
    WITNESS = "witness"
    """A tap on the line that hears both ends, as in a capture: kinds are told apart by their looks."""


class Verdict(Enum):
    """What an answer's code says about a command, in words both generations share."""

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


class Command(NamedTuple):
    """One command as a person names it.

    Attributes:
        did: device id, 0-255.
        cid: command id, 0-255.
        payload: the argument bytes.
        target: byte of the node's ``Address``, or None to leave addresses out.
    """

    did: int
    cid: int
    payload: bytes = b""
    target: int | None = None


class Request(NamedTuple):
    """A command as the robot's end hears it.

    Attributes:
        command: what is asked.
        seq: the handle that the answer will echo, 0-255.
        source: address byte of who asks, None where absent.
        flags: the raw flag byte(s), first byte lowest; meaning depends on the generation.
        wants_answer: a response is expected to this request whatever its code.
    """

    command: Command
    seq: int
    source: int | None = None
    flags: int = 0
    wants_answer: bool = True


class Response(NamedTuple):
    """An answer to a command.

    Attributes:
        seq: the handle of the request, 0-255.
        code: the error code as it was sent, 0-255; ``Codec.verdict`` gives it a meaning.
        payload: the data bytes.
        did: device id, None where the generation does not send it back.
        cid: command id, None likewise.
        source: address byte of the node that answered, None where absent.
        target: address byte of who asked, None where absent.
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
    """What a robot says unasked.

    Attributes:
        did: device id; None in V1, whose async id stands in ``cid``.
        cid: command id, or the V1 async id.
        payload: the data bytes.
        source: address byte of the node that speaks, None where absent.
        target: address byte of the listener, None where absent.
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
    """Bytes that are no packet: evidence, never raised.

    Attributes:
        raw: the bytes as they came.
        reason: what is wrong with them, in words.
    """

    raw: bytes
    reason: str


Packet = Request | Response | Notification | Malformed
