"""How robots of a generation address what they say: requests come in, responses and notifications go out."""

from collections.abc import Callable
from typing import Final, NamedTuple

from sphero_probe.catalogue.model import AnswerStyle
from sphero_probe.protocol.address import WILDCARD, Address
from sphero_probe.protocol.packets import Generation, Notification, Request, Response, Verdict
from sphero_probe.protocol.v1 import SOP2_ACTIVITY, V1
from sphero_probe.protocol.v2 import FLAG_ACTIVITY, FLAG_ANSWER, FLAG_ONLY_ERRORS, V2

_BEHIND_UART: Final = 2
"""Where a robot sees a client whose target byte has port 0 [real, RVR: command to 01, answer to 21]."""
_FIRST_CLIENT: Final = 1
"""The node a client has when it does not say."""


class ResponseStyle(NamedTuple):
    """What a generation does around a command, whatever the command.

    Attributes:
        node_wanted: request -> the node it is meant for, 0 for whoever can serve it.
        objection: request -> why it is refused before anybody looks at the command, None when it is not.
        is_answered: request, whether it went well -> whether a response is sent.
        is_activity: request -> whether it starts the sleep timer anew.
        respond: request, style, node that serves, code, payload -> the response.
        notify: style, node that speaks, (did, cid), payload -> the notification; did None in V1.
    """

    node_wanted: Callable[[Request], int]
    objection: Callable[[Request], Verdict | None]
    is_answered: Callable[[Request, bool], bool]
    is_activity: Callable[[Request], bool]
    respond: Callable[[Request, AnswerStyle, int, int, bytes], Response]
    notify: Callable[[AnswerStyle, int, tuple[int | None, int], bytes], Notification]


def _node_wanted(request: Request) -> int:
    target = request.command.target
    return WILDCARD if target is None else Address.from_byte(target).node


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


def _respond(request: Request, style: AnswerStyle, node: int, code: int, payload: bytes) -> Response:
    command = request.command
    target: int | None = None
    source: int | None = None
    if style is AnswerStyle.SOURCE_ONLY:
        source = node
    elif style is AnswerStyle.SWAPPED:
        port = Address.from_byte(command.target or 0).port or _BEHIND_UART
        if command.target is not None or request.source is not None:
            source = node
        if request.source is not None:
            target = Address(port, Address.from_byte(request.source).node or _FIRST_CLIENT).byte
    activity = request.flags & FLAG_ACTIVITY
    return Response(request.seq, code, payload, command.did, command.cid, source, target, activity)


def _notify(style: AnswerStyle, node: int, pair: tuple[int | None, int], payload: bytes) -> Notification:
    source = None if style is AnswerStyle.NONE else node
    return Notification(*pair, payload, source, flags=FLAG_ACTIVITY)


def _v1_is_answered(request: Request, _well: bool) -> bool:
    return request.wants_answer


def _v1_respond(request: Request, _style: AnswerStyle, _node: int, code: int, payload: bytes) -> Response:
    return Response(request.seq, code, payload)


def _v1_notify(_style: AnswerStyle, _node: int, pair: tuple[int | None, int], payload: bytes) -> Notification:
    return Notification(*pair, payload)


RESPONSE_STYLES: Final[dict[Generation, ResponseStyle]] = {
    V1.generation: ResponseStyle(
        node_wanted=lambda _request: 0,
        objection=lambda _request: None,
        is_answered=_v1_is_answered,
        is_activity=lambda request: bool(request.flags & SOP2_ACTIVITY),
        respond=_v1_respond,
        notify=_v1_notify,
    ),
    V2.generation: ResponseStyle(_node_wanted, _objection, _is_answered, _is_activity, _respond, _notify),
}
"""The generations that a fake robot can speak."""
