"""What is in flight, on a virtual clock: things end in every order, while somebody waits or nobody does."""

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
    """Ask something: it goes out so many times at once, and ends after some seconds."""

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


def test_what_ends_comes_out_in_order() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        for item, seconds in (("a", 3.0), ("b", 1.0), ("c", 2.0)):
            flying.start(item, after(seconds, item.upper()))
        assert flying.items == ["a", "b", "c"]
        assert await flying.some() == [Ended("b", 0, "B")]
        assert asyncio.get_running_loop().time() == 1.0
        assert flying.items == ["a", "c"]
        assert await flying.all() == [Ended("c", 0, "C"), Ended("a", 0, "A")]
        assert (len(flying), flying.items, await flying.some(), await flying.all()) == (0, [], [], [])

    run(scenario())


def test_what_ended_while_nobody_waited_comes_out_at_once() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        for item in range(5):
            flying.start(item, after(5.0 - item))
        await asyncio.sleep(3.5)
        assert len(flying) == 5
        assert flying.items == [0, 1]
        assert items(await flying.some()) == [4, 3, 2]
        assert asyncio.get_running_loop().time() == 3.5
        assert len(flying) == 2
        assert items(await flying.all()) == [1, 0]

    run(scenario())


def test_all_waits_for_what_was_started_meanwhile() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        flying.start("first", after(1.0))
        waiting = asyncio.create_task(flying.all())
        await asyncio.sleep(0.5)
        flying.start("second", after(1.0))
        assert items(await waiting) == ["first", "second"]

    run(scenario())


def test_how_many_have_not_gone_out() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        gate = asyncio.Event()

        async def ask(before_sending: Callable[[], None]) -> None:
            await gate.wait()
            before_sending()
            await asyncio.sleep(1.0)
            before_sending()

        async def never_sent(before_sending: Callable[[], None]) -> None:
            await asyncio.sleep(0.5)

        flying.start(1, ask)
        flying.start(2, ask)
        flying.start(3, never_sent)
        assert flying.waiting == 3
        await asyncio.sleep(0.25)
        assert flying.waiting == 3
        await flying.some()
        assert flying.waiting == 2
        gate.set()
        await asyncio.sleep(0.25)
        assert (flying.waiting, len(flying)) == (0, 2)
        await flying.all()
        assert flying.waiting == 0

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
        flying = in_flight_probes(lambda: int(asyncio.get_running_loop().time()))

        async def ask(before_sending: Callable[[], None]) -> str:
            for _ in range(times):
                await asyncio.sleep(1.0)
                before_sending()
            if isinstance(answer, LinkLostError):
                raise answer
            return answer

        await asyncio.sleep(10.0)
        flying.start("thing", ask)
        assert await flying.some() == [Ended("thing", stamp, answer)]

    run(scenario())


def test_a_lost_line_is_a_way_to_end() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        lost = LinkLostError("torn off")
        flying.start("sent", after(1.0, lost))
        flying.start("not sent", after(1.5, lost, sent=0))
        flying.start("answered", after(0.5))
        assert await flying.all() == [
            Ended("answered", 0, "answer"),
            Ended("sent", 0, lost),
            Ended("not sent", None, lost),
        ]
        assert flying.waiting == 0

    run(scenario())


@pytest.mark.parametrize("way", [InFlight.some, InFlight.all])
def test_any_other_error_comes_out_where_somebody_looks(way: Way) -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        flying.start("good", after(0.25))
        flying.start("first", after(0.5, ZeroDivisionError("first")))
        flying.start("second", after(0.75, ValueError("second")))
        flying.start("slow", after(5.0))
        await asyncio.sleep(1.0)
        with pytest.raises(ZeroDivisionError, match="first"):
            await way(flying)
        await flying.close()
        assert flying.items == []

    run(scenario())


def test_an_error_wakes_whoever_waits() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        flying.start("bad", after(0.5, ZeroDivisionError()))
        flying.start("slow", after(5.0))
        with pytest.raises(ZeroDivisionError):
            await flying.some()
        assert asyncio.get_running_loop().time() == 0.5
        await flying.close()

    run(scenario())


@pytest.mark.parametrize("turns", range(4))
def test_closing_gives_everything_up(turns: int) -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        cancelled = []

        async def ask(before_sending: Callable[[], None]) -> None:
            before_sending()
            try:
                await asyncio.sleep(1.0)
            except asyncio.CancelledError:
                cancelled.append("sent")
                raise

        for item in range(3):
            flying.start(item, ask)
        flying.start("not sent", after(1.0, sent=0))
        for _ in range(turns):
            await asyncio.sleep(0)
        await flying.close()
        assert cancelled == ["sent"] * (3 if turns else 0)
        assert (len(flying), flying.waiting, flying.items) == (0, 0, [])
        assert await flying.some() == await flying.all() == []
        await flying.close()
        flying.start("again", after(1.0))
        assert items(await flying.some()) == ["again"]

    run(scenario())


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("way", [InFlight.some, InFlight.all])
def test_closing_ends_the_waiting(way: Way, turns: int) -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        flying.start("thing", after(1.0))
        waiting = asyncio.create_task(way(flying))
        for _ in range(turns):
            await asyncio.sleep(0)
        await flying.close()
        assert await waiting == []
        assert asyncio.get_running_loop().time() == 0.0

    run(scenario())


def test_a_task_that_gives_itself_up_ends_the_waiting() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        flying.start("given up", after(0.5, asyncio.CancelledError()))
        assert await flying.some() == []
        assert (len(flying), flying.waiting) == (0, 0)

    run(scenario())


def test_who_stops_waiting_loses_nothing() -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        for item in range(3):
            flying.start(item, after(1.0 + item))
        for way in (flying.some, flying.all):
            hasty = asyncio.create_task(way())
            await asyncio.sleep(0.25)
            hasty.cancel()
            await asyncio.gather(hasty, return_exceptions=True)
            assert hasty.cancelled()
        assert items(await flying.all()) == [0, 1, 2]

    run(scenario())


@given(
    turns=st.lists(st.integers(0, 8), min_size=1, max_size=12),
    pauses=st.lists(st.integers(0, 5), min_size=1, max_size=6),
    more=st.integers(0, 6),
)
def test_nothing_is_lost_and_nothing_comes_twice(turns: list[int], pauses: list[int], more: int) -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        for item, count in enumerate(turns):
            flying.start(item, steps(count, answer=-item))
        seen, looks, started = [], 0, len(turns)
        while flying:
            for _ in range(pauses[looks % len(pauses)]):
                await asyncio.sleep(0)
            ended = await flying.some()
            if ended and looks < more:  # what is answered leads to the next question
                flying.start(started, steps(looks, answer=-started))
                started += 1
            looks += 1
            seen += ended
        assert sorted(items(seen)) == list(range(started))
        assert [end.answer for end in seen] == [-end.item for end in seen]
        assert flying.waiting == 0
        assert await flying.some() == []

    run(scenario())


@given(st.lists(st.integers(0, 5), max_size=8))
def test_all_leaves_nothing(turns: list[int]) -> None:
    async def scenario() -> None:
        flying = in_flight_probes()
        for item, count in enumerate(turns):
            flying.start(item, steps(count))
        seen = items(await flying.all())
        assert sorted(seen) == list(range(len(turns)))
        assert seen == sorted(seen, key=lambda item: turns[item])
        assert len(flying) == 0

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


def test_together_one_error_gives_up_the_others() -> None:
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


def test_together_is_given_up_as_one() -> None:
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
