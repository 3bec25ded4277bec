"""The virtual clock: time passes without waiting, and a loop that waits for nothing is an error."""

import asyncio
import time

import pytest

from sphero_probe.virtual_clock import A_MONTH, VirtualClock


def run_on_clock(seconds: float) -> tuple[float, float]:
    """Sleep on a virtual clock; return its time and the real time that passed."""

    async def sleep() -> float:
        await asyncio.sleep(seconds)
        return asyncio.get_running_loop().time()

    began = time.monotonic()
    with asyncio.Runner(loop_factory=VirtualClock) as runner:
        return runner.run(sleep()), time.monotonic() - began


def test_a_day_passes_at_once() -> None:
    virtual, real = run_on_clock(86400)
    assert virtual == 86400
    assert real < 3600


def test_the_clock_stands_still_between_two_calls() -> None:
    async def now() -> float:
        return asyncio.get_running_loop().time()

    with asyncio.Runner(loop_factory=VirtualClock) as runner:
        first = runner.run(now())
        time.sleep(0.02)
        assert runner.run(now()) == first


def test_waiting_for_what_never_comes_is_an_error() -> None:
    async def never() -> None:
        await asyncio.get_running_loop().create_future()

    loop = VirtualClock()
    try:
        with pytest.raises(RuntimeError, match="every task waits"):
            loop.run_until_complete(never())
    finally:
        loop.close()


def test_more_than_a_month_is_an_error() -> None:
    loop = VirtualClock()
    try:
        with pytest.raises(RuntimeError, match="nothing happened for a month"):
            loop.run_until_complete(asyncio.sleep(2 * A_MONTH))
    finally:
        loop.close()
