"""Items in flight, on a virtual clock: they end in every order, with and without a waiting call."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.errors import LinkLostError
from sphero_probe.link.concurrent import ask_together
from sphero_probe.probing.inflight import Ended, InFlight
from tests.support.virtual_clock import run

Ask = Callable[[Callable[[], None]], Coroutine[Any, Any, Any]]
Way = Callable[[InFlight[Any, Any]], Coroutine[Any, Any, list[Ended[Any, Any]]]]


def in_flight_probes(stamp: Callable[[], int] = lambda: 0) -> InFlight[Any, Any]:
    return InFlight(stamp)


def after(
    seconds: float,
    answer: BaseException | str = "answer",
    *,
    sent: int = 1,
) -> Ask:
    """Return an ask that sends so many times at once, and ends after some seconds."""

    async def ask(before_sending: Callable[[], None]) -> str:
        for _ in range(sent):
            before_sending()
        await asyncio.sleep(seconds)
        if isinstance(answer, BaseException):
            raise answer
        return answer

    return ask


def steps(count: int, answer: int | str = "answer") -> Ask:
    """Ask something that ends after so many turns of the event loop."""

    async def ask(before_sending: Callable[[], None]) -> int | str:
        before_sending()
        for _ in range(count):
            await asyncio.sleep(0)
        return answer

    return ask


def items(ended: list[Ended[Any, Any]]) -> list[Any]:
    return [end.item for end in ended]


def test_items_are_returned_in_order_of_ending() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        for item, seconds in (("a", 3.0), ("b", 1.0), ("c", 2.0)):
            in_flight.start(item, after(seconds, item.upper()))
        assert [*in_flight.items] == ["a", "b", "c"]
        assert await in_flight.wait_any() == [Ended("b", 0, "B")]
        assert asyncio.get_running_loop().time() == 1.0
        assert [*in_flight.items] == ["a", "c"]
        assert await in_flight.wait_all() == [Ended("c", 0, "C"), Ended("a", 0, "A")]
        assert (
            len(in_flight),
            [*in_flight.items],
            await in_flight.wait_any(),
            await in_flight.wait_all(),
        ) == (
            0,
            [],
            [],
            [],
        )

    run(scenario())


def test_items_that_ended_unwatched_are_returned_at_once() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        for item in range(5):
            in_flight.start(item, after(5.0 - item))
        await asyncio.sleep(3.5)
        assert len(in_flight) == 5
        assert [*in_flight.items] == [0, 1]
        assert items(await in_flight.wait_any()) == [4, 3, 2]
        assert asyncio.get_running_loop().time() == 3.5
        assert len(in_flight) == 2
        assert items(await in_flight.wait_all()) == [1, 0]

    run(scenario())


def test_all_waits_for_what_was_started_meanwhile() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        in_flight.start("first", after(1.0))
        waiting = asyncio.create_task(in_flight.wait_all())
        await asyncio.sleep(0.5)
        in_flight.start("second", after(1.0))
        assert items(await waiting) == ["first", "second"]

    run(scenario())


def test_how_many_were_not_sent_yet() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        gate = asyncio.Event()

        async def ask(before_sending: Callable[[], None]) -> None:
            await gate.wait()
            before_sending()
            await asyncio.sleep(1.0)
            before_sending()

        async def never_sent(before_sending: Callable[[], None]) -> None:
            await asyncio.sleep(0.5)

        in_flight.start(1, ask)
        in_flight.start(2, ask)
        in_flight.start(3, never_sent)
        assert in_flight.waiting == 3
        await asyncio.sleep(0.25)
        assert in_flight.waiting == 3
        await in_flight.wait_any()
        assert in_flight.waiting == 2
        gate.set()
        await asyncio.sleep(0.25)
        assert (in_flight.waiting, len(in_flight)) == (0, 2)
        await in_flight.wait_all()
        assert in_flight.waiting == 0

    run(scenario())


@pytest.mark.parametrize(
    ("times", "stamp"),
    [
        pytest.param(0, None, id="never"),
        pytest.param(1, 10, id="once: when it was started"),
        pytest.param(2, 12, id="twice: when it was sent again"),
        pytest.param(4, 14, id="often: when it was sent last"),
    ],
)
@pytest.mark.parametrize("answer", ["answer", LinkLostError("gone")])
def test_what_an_end_is_stamped_with(times: int, stamp: int | None, answer: LinkLostError | str) -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes(lambda: int(asyncio.get_running_loop().time()))

        async def ask(before_sending: Callable[[], None]) -> str:
            for _ in range(times):
                await asyncio.sleep(1.0)
                before_sending()
            if isinstance(answer, LinkLostError):
                raise answer
            return answer

        await asyncio.sleep(10.0)
        in_flight.start("thing", ask)
        assert await in_flight.wait_any() == [Ended("thing", stamp, answer)]

    run(scenario())


def test_a_lost_line_is_a_way_to_end() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        lost = LinkLostError("torn off")
        in_flight.start("sent", after(1.0, lost))
        in_flight.start("not sent", after(1.5, lost, sent=0))
        in_flight.start("answered", after(0.5))
        assert await in_flight.wait_all() == [
            Ended("answered", 0, "answer"),
            Ended("sent", 0, lost),
            Ended("not sent", None, lost),
        ]
        assert in_flight.waiting == 0

    run(scenario())


@pytest.mark.parametrize("way", [InFlight.wait_any, InFlight.wait_all])
def test_any_other_error_is_raised_on_collecting(way: Way) -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        in_flight.start("good", after(0.25))
        in_flight.start("first", after(0.5, ZeroDivisionError("first")))
        in_flight.start("second", after(0.75, ValueError("second")))
        in_flight.start("slow", after(5.0))
        await asyncio.sleep(1.0)
        with pytest.raises(ZeroDivisionError, match="first"):
            await way(in_flight)
        await in_flight.close()
        assert [*in_flight.items] == []

    run(scenario())


def test_an_error_wakes_a_waiting_call() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        in_flight.start("bad", after(0.5, ZeroDivisionError()))
        in_flight.start("slow", after(5.0))
        with pytest.raises(ZeroDivisionError):
            await in_flight.wait_any()
        assert asyncio.get_running_loop().time() == 0.5
        await in_flight.close()

    run(scenario())


@pytest.mark.parametrize("turns", range(4))
def test_closing_cancels_everything(turns: int) -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        cancelled = []

        async def ask(before_sending: Callable[[], None]) -> None:
            before_sending()
            try:
                await asyncio.sleep(1.0)
            except asyncio.CancelledError:
                cancelled.append("sent")
                raise

        for item in range(3):
            in_flight.start(item, ask)
        in_flight.start("not sent", after(1.0, sent=0))
        for _ in range(turns):
            await asyncio.sleep(0)
        await in_flight.close()
        assert cancelled == ["sent"] * (3 if turns else 0)
        assert (len(in_flight), in_flight.waiting, [*in_flight.items]) == (0, 0, [])
        assert await in_flight.wait_any() == await in_flight.wait_all() == []
        await in_flight.close()
        in_flight.start("again", after(1.0))
        assert items(await in_flight.wait_any()) == ["again"]

    run(scenario())


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("way", [InFlight.wait_any, InFlight.wait_all])
def test_closing_ends_the_waiting(way: Way, turns: int) -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        in_flight.start("thing", after(1.0))
        waiting = asyncio.create_task(way(in_flight))
        for _ in range(turns):
            await asyncio.sleep(0)
        await in_flight.close()
        assert await waiting == []
        assert asyncio.get_running_loop().time() == 0.0

    run(scenario())


def test_a_task_that_cancels_itself_ends_the_waiting() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        in_flight.start("given up", after(0.5, asyncio.CancelledError()))
        assert await in_flight.wait_any() == []
        assert (len(in_flight), in_flight.waiting) == (0, 0)

    run(scenario())


def test_a_cancelled_wait_loses_nothing() -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        for item in range(3):
            in_flight.start(item, after(1.0 + item))
        for way in (in_flight.wait_any, in_flight.wait_all):
            hasty = asyncio.create_task(way())
            await asyncio.sleep(0.25)
            hasty.cancel()
            await asyncio.gather(hasty, return_exceptions=True)
            assert hasty.cancelled()
        assert items(await in_flight.wait_all()) == [0, 1, 2]

    run(scenario())


@given(
    turns=st.lists(st.integers(0, 8), min_size=1, max_size=12),
    pauses=st.lists(st.integers(0, 5), min_size=1, max_size=6),
    more=st.integers(0, 6),
)
def test_nothing_is_lost_and_nothing_comes_twice(turns: list[int], pauses: list[int], more: int) -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        for item, count in enumerate(turns):
            in_flight.start(item, steps(count, answer=-item))
        seen, looks, started = [], 0, len(turns)
        while in_flight:
            for _ in range(pauses[looks % len(pauses)]):
                await asyncio.sleep(0)
            ended = await in_flight.wait_any()
            if ended and looks < more:  # what is answered leads to the next question
                in_flight.start(started, steps(looks, answer=-started))
                started += 1
            looks += 1
            seen += ended
        assert sorted(items(seen)) == list(range(started))
        assert [end.answer for end in seen] == [-end.item for end in seen]
        assert in_flight.waiting == 0
        assert await in_flight.wait_any() == []

    run(scenario())


@given(st.lists(st.integers(0, 5), max_size=8))
def test_all_leaves_nothing(turns: list[int]) -> None:
    async def scenario() -> None:
        in_flight = in_flight_probes()
        for item, count in enumerate(turns):
            in_flight.start(item, steps(count))
        seen = items(await in_flight.wait_all())
        assert sorted(seen) == list(range(len(turns)))
        assert seen == sorted(seen, key=lambda item: turns[item])
        assert len(in_flight) == 0

    run(scenario())


def test_together() -> None:
    async def ask(seconds: float) -> float:
        await asyncio.sleep(seconds)
        return seconds

    async def scenario() -> None:
        assert await ask_together(ask(seconds) for seconds in (3.0, 1.0, 2.0)) == [3.0, 1.0, 2.0]
        assert asyncio.get_running_loop().time() == 3.0
        assert await ask_together([]) == []

    run(scenario())


def test_together_one_error_cancels_the_others() -> None:
    ended = []

    async def ask(seconds: float, error: LinkLostError | ValueError | None = None) -> None:
        try:
            await asyncio.sleep(seconds)
            if error:
                raise error
        finally:
            ended.append(seconds)

    async def scenario() -> None:
        with pytest.raises(LinkLostError, match="torn off"):
            await ask_together(
                [ask(9.0), ask(1.0, LinkLostError("torn off")), ask(1.0, ValueError()), ask(8.0)]
            )
        assert sorted(ended) == [1.0, 1.0, 8.0, 9.0]
        assert asyncio.get_running_loop().time() == 1.0

    run(scenario())


def test_together_is_cancelled_as_one() -> None:
    ended = []

    async def ask(seconds: float) -> None:
        try:
            await asyncio.sleep(seconds)
        finally:
            ended.append(asyncio.get_running_loop().time())

    async def scenario() -> None:
        both = asyncio.create_task(ask_together([ask(5.0), ask(6.0)]))
        await asyncio.sleep(0.5)
        both.cancel()
        await asyncio.gather(both, return_exceptions=True)
        assert both.cancelled()
        assert ended == [0.5, 0.5]

    run(scenario())
