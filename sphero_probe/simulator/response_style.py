"""Which responses and notifications robots of a generation send, and which addresses they put in."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

from sphero_probe.catalogue.model import AnswerStyle
from sphero_probe.protocol.packets import Generation, Notification, Request, Response, Verdict
from sphero_probe.protocol.v1 import SOP2_ACTIVITY, V1
from sphero_probe.protocol.v2 import FLAG_ACTIVITY, FLAG_ANSWER, FLAG_ONLY_ERRORS, V2
from sphero_probe.simulator.topology import Addresses

if TYPE_CHECKING:
    from sphero_probe.protocol.address import Address


class ResponseStyle(NamedTuple):
    """What the robots of a generation do around a command, whatever the command.

    Attributes:
        objection: request -> why it is refused whatever the command, None when it is not.
        is_answered: request, whether it went well -> whether a response is sent.
        is_activity: request -> whether it restarts the sleep timer.
        respond: request, style, addresses that the topology gives the answer, code, payload -> the response.
        notify: style, node that sends, (did, cid), payload -> the notification; did None in V1.
    """

    objection: Callable[[Request], Verdict | None]
    is_answered: Callable[[Request, bool], bool]
    is_activity: Callable[[Request], bool]
    respond: Callable[[Request, AnswerStyle, Addresses, int, bytes], Response]
    notify: Callable[[AnswerStyle, int, tuple[int | None, int], bytes], Notification]


def _objection(request: Request) -> Verdict | None:
    """Bit 2 is valid only together with bit 1 [vendor]."""
    alone = request.flags & (FLAG_ANSWER | FLAG_ONLY_ERRORS) == FLAG_ONLY_ERRORS
    return Verdict.FAILED if alone else None


def _is_answered(request: Request, well: bool) -> bool:
    if request.wants_answer or _objection(request):
        return True
    return bool(request.flags & FLAG_ANSWER) and not well


def _is_activity(request: Request) -> bool:
    return bool(request.flags & FLAG_ACTIVITY)


def _respond(
    request: Request, style: AnswerStyle, addresses: Addresses, code: int, payload: bytes
) -> Response:
    """Put in the addresses that this robot sends; a side that the client left out stays out."""
    command = request.command
    target: Address | None = None
    source: Address | None = None
    if style is AnswerStyle.SOURCE_ONLY:
        source = addresses.source
    elif style is AnswerStyle.SWAPPED:
        if command.target is not None or request.source is not None:
            source = addresses.source
        if request.source is not None:
            target = addresses.target
    sid, tid = (None if address is None else address.byte for address in (source, target))
    activity = request.flags & FLAG_ACTIVITY
    return Response(request.seq, code, payload, command.did, command.cid, sid, tid, activity)


def _notify(style: AnswerStyle, node: int, pair: tuple[int | None, int], payload: bytes) -> Notification:
    source = None if style is AnswerStyle.NONE else node
    return Notification(*pair, payload, source, flags=FLAG_ACTIVITY)


def _v1_is_answered(request: Request, _well: bool) -> bool:
    return request.wants_answer


def _v1_respond(
    request: Request, _style: AnswerStyle, _addresses: Addresses, code: int, payload: bytes
) -> Response:
    return Response(request.seq, code, payload)


def _v1_notify(_style: AnswerStyle, _node: int, pair: tuple[int | None, int], payload: bytes) -> Notification:
    return Notification(*pair, payload)


RESPONSE_STYLES: Final[dict[Generation, ResponseStyle]] = {
    V1.generation: ResponseStyle(
        objection=lambda _request: None,
        is_answered=_v1_is_answered,
        is_activity=lambda request: bool(request.flags & SOP2_ACTIVITY),
        respond=_v1_respond,
        notify=_v1_notify,
    ),
    V2.generation: ResponseStyle(_objection, _is_answered, _is_activity, _respond, _notify),
}
"""The generations of which there are fake robots."""
