"""Listeners of a link: each hears what it asked for once and in order, whatever the others do."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from datetime import UTC, datetime, timedelta

import pytest

from sphero_probe.errors import LinkLostError
from sphero_probe.link.events import (
    BytesReceived,
    Events,
    ExchangeEnded,
    FrameSent,
    LinkEvent,
    UnsolicitedReceived,
    wall_clock,
)
from sphero_probe.link.exchange import Answered, Blocked, LateResponse, Silent
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.link.tracker import QUIET
from sphero_probe.protocol.packets import Command, Malformed, Notification, Request
from sphero_probe.protocol.v2 import V2
from sphero_probe.session.reconnect import Reconnector
from sphero_probe.session.session import open_session
from tests.support.line import Line, Robot, after, answer_to
from tests.support.virtual_clock import run

BATTERY, SLEEP = Command(0x13, 0x10), Command(0x13, 0x01)
AWAKE = Notification(0x13, 0x11, b"", 1, None, 0xFF, 0x28)
SPOILT = Malformed(bytes.fromhex("8d09130d0000d7d8"), "checksum 0xd7, expected 0xd6")


@asynccontextmanager
async def linked(
    robot: Robot,
    *,
    timeout: float = 1.0,
    events: Events | None = None,
) -> AsyncIterator[tuple[Link, Line]]:
    line = Line(robot)
    policy = Policy(V2.generation, None, Consent(), ())
    async with Link(line, V2, policy, timeout=timeout, events=events) as link:
        yield link, line


def test_an_answered_command_is_told_in_order_with_its_times() -> None:
    async def scenario() -> None:
        heard: list[LinkEvent] = []
        async with linked(after(0.25)) as (link, line):
            link.events.subscribe(heard.append)
            await asyncio.sleep(1.0)
            exchange = await link.ask(BATTERY)
            assert isinstance(exchange, Answered)
            assert heard == [
                FrameSent(1.0, line.written[0]),
                BytesReceived(1.25, exchange.received),
                ExchangeEnded(1.25, exchange),
            ]

    run(scenario())


def test_every_kind_of_ending_and_of_unsolicited_packet_is_told_once() -> None:
    def robot(request: Request) -> list[tuple[float, bytes]]:
        said = answer_to(request)
        return [(0.25, V2.frame_of(AWAKE) + SPOILT.raw), (0.75, said), (0.875, said)]

    async def scenario() -> None:
        heard: list[LinkEvent] = []
        async with linked(robot, timeout=0.5) as (link, _):
            link.events.subscribe(heard.append, ExchangeEnded, UnsolicitedReceived)
            silent = await link.ask(BATTERY)
            blocked = await link.ask(SLEEP)
            await asyncio.sleep(1.0)
            assert isinstance(silent, Silent)
            assert isinstance(blocked, Blocked)
            unsolicited = [event.unsolicited for event in heard if isinstance(event, UnsolicitedReceived)]
            assert unsolicited[:2] == [AWAKE, SPOILT]
            assert [type(late) for late in unsolicited[2:]] == [LateResponse, LateResponse]
            assert [event.exchange for event in heard if isinstance(event, ExchangeEnded)] == [
                silent,
                blocked,
            ]
            assert [round(event.time, 3) for event in heard] == [0.25, 0.25, 0.5, 0.5, 0.75, 0.875]

    run(scenario())


def test_an_incomplete_frame_that_is_given_up_is_told() -> None:
    async def scenario() -> None:
        heard: list[UnsolicitedReceived] = []
        async with linked(lambda request: [(0.1, answer_to(request)[:-1])], timeout=0.2 + QUIET) as (link, _):
            link.events.subscribe(heard.append, UnsolicitedReceived)
            assert isinstance(await link.ask(BATTERY), Silent)
            assert [type(event.unsolicited) for event in heard] == [Malformed]

    run(scenario())


def test_listeners_are_called_before_the_asking_task_continues() -> None:
    async def scenario() -> None:
        order: list[str] = []
        async with linked(after(0.25)) as (link, _):
            link.events.subscribe(lambda _: order.append("listener"), ExchangeEnded)
            await link.ask(BATTERY)
            order.append("asking task")
        assert order == ["listener", "asking task"]

    run(scenario())


def test_each_of_many_listeners_hears_each_event_once() -> None:
    async def scenario() -> None:
        first: list[LinkEvent] = []
        second: list[LinkEvent] = []
        answers: list[ExchangeEnded] = []
        async with linked(after(0.25)) as (link, _):
            link.events.subscribe(first.append)
            link.events.subscribe(answers.append, ExchangeEnded)
            link.events.subscribe(second.append)
            await asyncio.gather(*[link.ask(BATTERY) for _ in range(10)])
        assert first == second
        assert len(first) == 30
        assert len(answers) == len(set(answers)) == 10

    run(scenario())


def test_a_listener_may_come_and_go() -> None:
    async def scenario() -> None:
        heard: list[LinkEvent] = []
        async with linked(after(0.25)) as (link, _):
            await link.ask(BATTERY)
            with link.events.subscribe(heard.append, ExchangeEnded) as subscription:
                await link.ask(BATTERY)
                assert link.events.wanted(ExchangeEnded)
            await link.ask(BATTERY)
            subscription.cancel()
            assert len(heard) == 1
            assert not link.events.wanted(ExchangeEnded)

    run(scenario())


def test_a_listener_cancelled_by_another_hears_nothing_more() -> None:
    async def scenario() -> None:
        events = Events()
        heard: list[LinkEvent] = []
        events.subscribe(lambda _: last.cancel())
        last = events.subscribe(heard.append)
        events.emit(FrameSent(0.0, b""))
        events.emit(FrameSent(1.0, b""))
        assert heard == []

    run(scenario())


@pytest.mark.parametrize("kind", [FrameSent, BytesReceived, ExchangeEnded, UnsolicitedReceived])
def test_a_listener_that_raises_breaks_neither_the_link_nor_the_others(kind: type[LinkEvent]) -> None:
    def stumble(_: LinkEvent) -> None:
        raise ZeroDivisionError("disk full")

    async def scenario() -> None:
        reported: list[dict[str, object]] = []
        heard: list[LinkEvent] = []
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: reported.append(context))
        async with linked(lambda request: [(0.125, V2.frame_of(AWAKE)), *after(0.25)(request)]) as (link, _):
            link.events.subscribe(stumble, kind)
            link.events.subscribe(heard.append, kind)
            assert isinstance(await link.ask(BATTERY), Answered)
            assert isinstance(await link.ask(BATTERY), Answered)
        assert len(heard) >= 2
        assert [type(context["exception"]) for context in reported] == [ZeroDivisionError] * len(heard)
        assert all(kind.__name__ in str(context["message"]) for context in reported)

    run(scenario())


def test_listeners_hear_the_link_that_replaces_a_lost_one() -> None:
    async def scenario() -> None:
        heard: list[LinkEvent] = []
        async with AsyncExitStack() as links:
            lost, _ = await links.enter_async_context(linked(after(0.25)))
            lost.events.subscribe(heard.append, ExchangeEnded)

            async def reconnect() -> Link:
                again, _ = await links.enter_async_context(linked(after(0.5)))
                return again

            line = Reconnector(lost, None, reconnect=reconnect)
            await line.open_again(LinkLostError("out of range"))
            assert line.link is not lost
            heard.clear()
            exchange = await line.link.ask(BATTERY)
            assert [event.exchange for event in heard if isinstance(event, ExchangeEnded)] == [exchange]
            assert len(heard) == 1

    run(scenario())


def test_a_session_keeps_its_listeners_from_the_first_frame_of_a_new_link_on() -> None:
    async def scenario() -> None:
        heard: list[LinkEvent] = []
        async with open_session("fake:bolt", Consent()) as session:
            session.link.events.subscribe(heard.append)
            before = session.link
            after_drop = await session.reconnect()
            assert after_drop is not before
            assert after_drop.events is before.events
            exchange = await after_drop.ask(BATTERY)
            assert [type(event) for event in heard] == [FrameSent, BytesReceived, ExchangeEnded]
            assert heard[-1][1] == exchange

    asyncio.run(scenario())


def test_the_wall_clock_of_an_event() -> None:
    async def scenario() -> None:
        now = asyncio.get_running_loop().time()
        told = [datetime.fromisoformat(wall_clock(time)) for time in (now - 90.0, now)]
        assert abs(told[1] - told[0] - timedelta(seconds=90)) < timedelta(milliseconds=100)
        assert abs(told[1] - datetime.now(UTC)) < timedelta(seconds=10)
        assert wall_clock(now).endswith("Z")

    run(scenario())
