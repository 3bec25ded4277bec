"""How asking one command ended, and what was heard besides: the values a link hands out."""

from typing import NamedTuple

from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Command, Malformed, Notification, Response


class Answered(NamedTuple):
    """The robot answered.

    Attributes:
        command: what was asked.
        seq: the handle it went out with.
        sent: the frame as it went out.
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
    """No answer came in time, which proves nothing yet.

    Attributes:
        command: what was asked.
        seq: the handle it went out with.
        sent: the frame as it went out.
        waited: seconds.
    """

    command: Command
    seq: int
    sent: bytes
    waited: float


class Blocked(NamedTuple):
    """The guard did not let the command out: nothing was sent.

    Attributes:
        command: what was to be asked.
        risk: its class.
        reason: why not, and which flag would allow it.
    """

    command: Command
    risk: Risk
    reason: str


Exchange = Answered | Silent | Blocked


class LateResponse(NamedTuple):
    """An answer that no waiting command asked for: too late, a duplicate, or foreign; credited to no other.

    Attributes:
        response: the answer.
        received: its frame.
        earlier: the settled exchange it belongs to, None where it fits none.
        took: seconds since the command was sent, None where it fits none.
    """

    response: Response
    received: bytes
    earlier: Answered | Silent | None
    took: float | None = None


Unsolicited = Notification | Malformed | LateResponse
