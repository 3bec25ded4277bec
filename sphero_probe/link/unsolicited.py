"""Describe unsolicited packets as JSON, the same for ``listen`` and for the notes of a run."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sphero_probe.catalogue.packet_json import packet_json
from sphero_probe.link.events import ExchangeEnded, UnsolicitedReceived, wall_clock
from sphero_probe.link.exchange import Answered, LateResponse, Silent, Unsolicited
from sphero_probe.link.link import Link
from sphero_probe.protocol.packets import Command, Verdict


@contextmanager
def follow_streams(link: Link) -> Iterator[None]:
    """Note in ``link.streams`` what the robot accepts to stream while the context lasts.

    It goes on after a reconnect, if the next link has the same streams and events.

    Args:
        link: to the robot.
    """
    codec, streams = link.codec, link.streams

    def follow(command: Command, code: int) -> None:
        if codec.verdict(code) is Verdict.OK:
            streams.executed(command)

    def on_exchange(event: ExchangeEnded) -> None:
        if isinstance(event.exchange, Answered):
            follow(event.exchange.command, event.exchange.response.code)

    def on_unsolicited(event: UnsolicitedReceived) -> None:
        late = event.unsolicited
        if isinstance(late, LateResponse) and isinstance(late.earlier, Silent):
            follow(late.earlier.command, late.response.code)

    with (
        link.events.subscribe(on_exchange, ExchangeEnded),
        link.events.subscribe(on_unsolicited, UnsolicitedReceived),
    ):
        yield


@contextmanager
def describe_unsolicited(
    link: Link, listener: Callable[[Unsolicited, dict[str, object]], None]
) -> Iterator[None]:
    """Call a listener for every unsolicited packet while the context lasts, also after a reconnect.

    Each description has ``time``, when it arrived in RFC 3339 UTC, and the keys of ``packet_json``; a late
    response is described as a response. Sensor streams are decoded by the masks that the robot accepted since
    the context was entered, or before, as far as ``link.streams`` knows.

    Args:
        link: to the robot.
        listener: called with each notification, late response or malformed frame, and its description.
    """
    robot, codec, streams = link.policy.robot, link.codec, link.streams

    def on_unsolicited(event: UnsolicitedReceived) -> None:
        unsolicited = event.unsolicited
        packet = unsolicited.response if isinstance(unsolicited, LateResponse) else unsolicited
        raw = codec.frame_of(packet)
        described = packet_json(packet, codec.generation, raw, robot, streams)
        listener(unsolicited, {"time": wall_clock(event.time), **described})

    with follow_streams(link), link.events.subscribe(on_unsolicited, UnsolicitedReceived):
        yield
