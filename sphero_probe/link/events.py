"""Tell any number of listeners what happens on a link: bytes both ways, ended exchanges, unsolicited packets.

A link emits each event once and in order, before the task that asked continues. A listener subscribes to the
kinds that it needs; an event without listeners is not built.
"""

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from types import TracebackType
from typing import Any, Final, Generic, NamedTuple, Self, TypeVar

from sphero_probe.link.exchange import Exchange, Unsolicited


class FrameSent(NamedTuple):
    """A command frame was handed to the transport.

    Attributes:
        time: seconds on the clock of the event loop.
        frame: the bytes.
    """

    time: float
    frame: bytes


class BytesReceived(NamedTuple):
    """Bytes arrived from the robot, in the pieces that the transport delivered.

    Each complete frame in them is reported by an ``ExchangeEnded`` or an ``UnsolicitedReceived`` event.

    Attributes:
        time: seconds on the clock of the event loop.
        data: the bytes, at least one.
    """

    time: float
    data: bytes


class ExchangeEnded(NamedTuple):
    """One attempt at a command ended: answered, silent, or blocked by the policy.

    An attempt that was cut short because the link was lost is not reported.

    Attributes:
        time: seconds on the clock of the event loop.
        exchange: how it ended.
    """

    time: float
    exchange: Exchange


class UnsolicitedReceived(NamedTuple):
    """The robot sent something that no waiting command asked for.

    Attributes:
        time: seconds on the clock of the event loop.
        unsolicited: a notification, a late response, or malformed bytes.
    """

    time: float
    unsolicited: Unsolicited


class ProbeComment(NamedTuple):
    """What a layer above says of a probe.

    Attributes:
        number: of the probe.
        text: one line.
        is_verdict: it is the result of the probe; otherwise it is about the frame that is sent next.
    """

    number: int
    text: str
    is_verdict: bool


class ProbeCommented(NamedTuple):
    """A layer above said something of a frame; the link itself emits none.

    Attributes:
        time: seconds on the clock of the event loop.
        comment: what it says.
    """

    time: float
    comment: ProbeComment


LinkEvent = FrameSent | BytesReceived | ExchangeEnded | UnsolicitedReceived | ProbeCommented
_KINDS: Final = (FrameSent, BytesReceived, ExchangeEnded, UnsolicitedReceived, ProbeCommented)
_Event = TypeVar("_Event", bound=LinkEvent)


class Subscription(Generic[_Event]):
    """One listener; ``cancel`` it, or use it as a context manager."""

    def __init__(self, events: "Events", listener: Callable[[_Event], None]) -> None:
        self.listener: Callable[[_Event], None] | None = listener
        self._events = events

    def cancel(self) -> None:
        """Stop calling the listener, even for the event being delivered now; may be called again."""
        self.listener = None
        self._events.drop(self)

    def __enter__(self) -> Self:
        """Return the subscription itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Cancel it."""
        self.cancel()


class Events:
    """The listeners of one conversation. They are kept over a reconnect and hear the new link."""

    def __init__(self) -> None:
        self._by_kind: dict[type[Any], tuple[Subscription[Any], ...]] = {}

    def subscribe(self, listener: Callable[[_Event], None], *kinds: type[_Event]) -> Subscription[_Event]:
        """Call a listener for every event of these kinds; for all kinds if none is named.

        Listeners are called one after the other on the event loop and must return quickly. What a listener
        raises goes to the loop's exception handler; the link and the other listeners continue.

        Args:
            listener: called with each event.
            kinds: classes of events.
        """
        subscription = Subscription(self, listener)
        for kind in kinds or _KINDS:
            self._by_kind[kind] = (*self._by_kind.get(kind, ()), subscription)
        return subscription

    def drop(self, subscription: Subscription[Any]) -> None:
        """Forget a subscription; ``Subscription.cancel`` calls this."""
        for kind, held in list(self._by_kind.items()):
            kept = tuple(other for other in held if other is not subscription)
            if kept:
                self._by_kind[kind] = kept
            else:
                del self._by_kind[kind]

    def wanted(self, kind: object) -> bool:
        """Whether any listener subscribed to a kind, so that building an event is worth it."""
        return kind in self._by_kind

    def tell(self, kind: Callable[[float, Any], LinkEvent], time: float, what: object) -> None:
        """Build and emit an event, if any listener subscribed to its kind.

        Args:
            kind: the kind of event.
            time: on the event loop's clock.
            what: its other field.
        """
        if self.wanted(kind):
            self.emit(kind(time, what))

    def emit(self, event: LinkEvent) -> None:
        """Call every listener of this kind of event, in the order of subscribing."""
        for subscription in self._by_kind.get(type(event), ()):
            if subscription.listener is None:
                continue
            try:
                subscription.listener(event)
            except Exception as error:  # noqa: BLE001 - a failing listener must not break the link
                asyncio.get_running_loop().call_exception_handler(
                    {"message": f"a listener failed at {type(event).__name__}", "exception": error}
                )


def wall_clock(time: float) -> str:
    """Return the date and time of a recent moment as JSON writes it: RFC 3339 UTC with milliseconds.

    Call it soon after the event: the clock of the event loop stands still while the machine sleeps.

    Args:
        time: seconds on the clock of the running event loop.
    """
    ago = timedelta(seconds=asyncio.get_running_loop().time() - time)
    return (datetime.now(UTC) - ago).isoformat(timespec="milliseconds").replace("+00:00", "Z")
