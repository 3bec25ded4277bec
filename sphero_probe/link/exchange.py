"""The values that a link returns: how asking a command ended, and unsolicited packets."""

from typing import NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Command, Malformed, Notification, Response


class Answered(NamedTuple):
    """The robot answered.

    Attributes:
        command: the command that was sent.
        seq: its sequence number.
        sent: the frame that was sent.
        response: the answer.
        received: the answer's frame.
        rtt: seconds between the two.
    """

    command: Command
    seq: int
    sent: bytes
    response: Response
    received: bytes
    rtt: float


class Silent(NamedTuple):
    """No answer arrived in time. One silence proves nothing yet.

    Attributes:
        command: the command that was sent.
        seq: its sequence number.
        sent: the frame that was sent.
        waited: seconds.
    """

    command: Command
    seq: int
    sent: bytes
    waited: float


class Blocked(NamedTuple):
    """The policy blocked the command: nothing was sent.

    Attributes:
        command: the command that was not sent.
        risk: its class.
        reason: why it was blocked, and which flag would allow it.
    """

    command: Command
    risk: Risk
    reason: str


Exchange = Answered | Silent | Blocked


class LateResponse(NamedTuple):
    """A response that no waiting command asked for: too late, a duplicate, or foreign.

    Attributes:
        response: the answer.
        received: its frame.
        earlier: the ended exchange it belongs to, None if it belongs to none.
        took: seconds since the command was sent, None if it belongs to none.
    """

    response: Response
    received: bytes
    earlier: Answered | Silent | None
    took: float | None = None


Unsolicited = Notification | Malformed | LateResponse
