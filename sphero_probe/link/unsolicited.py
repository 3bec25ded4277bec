"""Describe unsolicited packets as JSON, the same for ``listen`` and for the notes of a run."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sphero_probe.catalogue.packet_json import packet_json
from sphero_probe.catalogue.streams import StreamDecoder
from sphero_probe.link.events import ExchangeEnded, UnsolicitedReceived, wall_clock
from sphero_probe.link.exchange import Answered, LateResponse, Silent, Unsolicited
from sphero_probe.link.link import Link
from sphero_probe.protocol.packets import Command, Verdict


@contextmanager
def describe_unsolicited(
    link: Link, listener: Callable[[Unsolicited, dict[str, object]], None]
) -> Iterator[None]:
    """Call a listener for every unsolicited packet while the context lasts, also after a reconnect.

    Each description has ``time``, when it arrived in RFC 3339 UTC, and the keys of ``packet_json``; a late
    response is described as a response. Sensor streams are decoded by the masks that the robot accepted since
    the context was entered.

    Args:
        link: to the robot.
        listener: called with each notification, late response or malformed frame, and its description.
    """
    robot, codec = link.policy.robot, link.codec
    streams = StreamDecoder(codec.generation, robot)

    def follow(command: Command, code: int) -> None:
        if codec.verdict(code) is Verdict.OK:
            streams.executed(command)

    def on_exchange(event: ExchangeEnded) -> None:
        if isinstance(event.exchange, Answered):
            follow(event.exchange.command, event.exchange.response.code)

    def on_unsolicited(event: UnsolicitedReceived) -> None:
        unsolicited = event.unsolicited
        packet = unsolicited.response if isinstance(unsolicited, LateResponse) else unsolicited
        if isinstance(unsolicited, LateResponse) and isinstance(unsolicited.earlier, Silent):
            follow(unsolicited.earlier.command, unsolicited.response.code)
        raw = codec.frame_of(packet)
        described = packet_json(packet, codec.generation, raw, robot, streams)
        listener(unsolicited, {"time": wall_clock(event.time), **described})

    with (
        link.events.subscribe(on_exchange, ExchangeEnded),
        link.events.subscribe(on_unsolicited, UnsolicitedReceived),
    ):
        yield
