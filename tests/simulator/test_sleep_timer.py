"""The timers of a robot: touches and times in, warnings, sleep and waking out."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.simulator.sleep_timer import SleepEvent, SleepTimer


def _pass(rest: SleepTimer, until: float) -> list[tuple[float, SleepEvent]]:
    """What happens until some time, each with its time."""
    turns = []
    while rest.due is not None and rest.due <= until:
        turns.append((rest.due, rest.take()))
    return turns


def test_it_warns_and_sleeps_after_the_last_touch() -> None:
    assert SleepTimer(60.0, 10.0).due is None
    rest = SleepTimer(60.0, 10.0)
    rest.begin(now=5.0)
    rest.begin(now=50.0)
    assert rest.due == 55.0
    rest.touch(now=40.0)
    assert _pass(rest, 89.0) == []
    assert _pass(rest, 1e9) == [(90.0, SleepEvent.WARN), (100.0, SleepEvent.SLEEP)]
    assert rest.due is None


def test_one_that_never_tires() -> None:
    rest = SleepTimer(None, 10.0)
    rest.begin(now=0.0)
    rest.touch(now=1.0)
    assert rest.due is None


def test_a_new_timeout_counts_from_the_next_touch() -> None:
    rest = SleepTimer(600.0, 10.0)
    rest.touch(now=0.0)
    rest.set_timeout(60.0)
    assert rest.due == 590.0
    rest.touch(now=1.0)
    assert rest.due == 51.0


@pytest.mark.parametrize(
    ("wakes", "turns"),
    [
        pytest.param(None, [], id="until it is woken"),
        pytest.param(30.0, [(30.0, SleepEvent.WAKE)], id="a while"),
    ],
)
def test_who_sleeps_waits_for_nothing_but_the_morning(
    wakes: float | None, turns: list[tuple[float, SleepEvent]]
) -> None:
    rest = SleepTimer(60.0, 10.0)
    rest.touch(now=0.0)
    rest.sleep(wakes)
    rest.begin(now=1.0)
    assert _pass(rest, 1e9) == turns


@given(st.lists(st.floats(0, 1e6), min_size=1, max_size=9), st.floats(0, 1e4), st.floats(0, 1e4))
def test_the_last_touch_counts(touches: list[float], timeout: float, notice: float) -> None:
    rest = SleepTimer(timeout, notice)
    for now in touches:
        rest.touch(now=now)
    *warnings, (slept, sleep) = _pass(rest, 1e9)
    assert (slept, sleep) == (touches[-1] + timeout, SleepEvent.SLEEP)
    expected = [(slept - notice, SleepEvent.WARN)] if timeout > notice else []
    assert warnings == expected


def test_one_that_starts_anew_does_nothing_before() -> None:
    rest = SleepTimer(60.0, 10.0)
    rest.touch(now=0.0)
    rest.boot(1.5)
    assert _pass(rest, 1e9) == [(1.5, SleepEvent.BOOT)]
