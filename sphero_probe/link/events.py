"""What happens on a link, for any number of listeners: bytes both ways, ended exchanges, unsolicited packets.

A link emits each event once, in the order in which things happen, before the task that asked goes on. A
listener subscribes to the kinds that it needs; an event that has no listener is not even built.
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
    """Bytes came from the robot, cut as the transport delivered them.

    Each frame in them follows as an ``ExchangeEnded`` or an ``UnsolicitedReceived`` once it is complete.

    Attributes:
        time: seconds on the clock of the event loop.
        data: the bytes, at least one.
    """

    time: float
    data: bytes


class ExchangeEnded(NamedTuple):
    """One attempt at a command ended: answered, silent, or blocked by the policy.

    An attempt that the loss of the link cut short has no end and is not told.

    Attributes:
        time: seconds on the clock of the event loop.
        exchange: how it ended.
    """

    time: float
    exchange: Exchange


class UnsolicitedReceived(NamedTuple):
    """The robot sent what no waiting command asked for.

    Attributes:
        time: seconds on the clock of the event loop.
        unsolicited: a notification, a late response, or malformed bytes.
    """

    time: float
    unsolicited: Unsolicited


LinkEvent = FrameSent | BytesReceived | ExchangeEnded | UnsolicitedReceived
_KINDS: Final = (FrameSent, BytesReceived, ExchangeEnded, UnsolicitedReceived)
_Event = TypeVar("_Event", bound=LinkEvent)


class Subscription(Generic[_Event]):
    """One listener; ``cancel`` it, or use it as a context manager."""

    def __init__(self, events: "Events", listener: Callable[[_Event], None]) -> None:
        self.listener: Callable[[_Event], None] | None = listener
        self._events = events

    def cancel(self) -> None:
        """Tell the listener nothing more, not even of the event that is being told; may be repeated."""
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
    """The listeners of one conversation; they outlive the link, and hear the next one after a reconnect."""

    def __init__(self) -> None:
        self._by_kind: dict[type[Any], tuple[Subscription[Any], ...]] = {}

    def subscribe(self, listener: Callable[[_Event], None], *kinds: type[_Event]) -> Subscription[_Event]:
        """Tell a listener of every event of these kinds, of all kinds where none is named.

        Listeners are called one after the other on the event loop and must return quickly. What a listener
        raises goes to the loop's exception handler; the link and the other listeners go on.

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
            left = tuple(one for one in held if one is not subscription)
            if left:
                self._by_kind[kind] = left
            else:
                del self._by_kind[kind]

    def wanted(self, kind: object) -> bool:
        """Whether any listener wants events of a kind, so that it is worth building one."""
        return kind in self._by_kind

    def tell(self, kind: Callable[[float, Any], LinkEvent], time: float, what: object) -> None:
        """Tell what happened, if any listener wants to hear of it.

        Args:
            kind: the kind of event.
            time: on the event loop's clock.
            what: its other field.
        """
        if self.wanted(kind):
            self.emit(kind(time, what))

    def emit(self, event: LinkEvent) -> None:
        """Tell every listener of this kind of event, in the order of subscribing."""
        for subscription in self._by_kind.get(type(event), ()):
            if subscription.listener is None:
                continue
            try:
                subscription.listener(event)
            except Exception as error:  # noqa: BLE001 - a listener's fault is not the link's
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
