"""Where commands wait: requests and times in, those who are served out."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.protocol.packets import Command, Request
from sphero_probe.simulator.command_queue import SERVICE, CommandQueue


def _request(seq: int) -> Request:
    return Request(Command(0x10, 0x00), seq)


def _served(queue: CommandQueue, until: float) -> list[tuple[float, int]]:
    served = []
    while queue.due is not None and queue.due <= until:
        served.append((queue.due, queue.take().seq))
    return served


@pytest.mark.parametrize("places", [1, 3, 8])
def test_a_burst_loses_exactly_the_surplus(places: int) -> None:
    queue = CommandQueue(places)
    for seq in range(20):
        queue.admit(_request(seq), now=1.0)
    served = _served(queue, 9.0)
    assert [seq for _, seq in served] == list(range(places + 1))
    assert [when for when, _ in served] == pytest.approx([1 + SERVICE * n for n in range(1, places + 2)])


def test_a_place_is_free_once_somebody_was_served() -> None:
    queue = CommandQueue(1)
    for seq in range(3):
        queue.admit(_request(seq), now=0.0)
    assert _served(queue, SERVICE) == [(SERVICE, 0)]
    queue.admit(_request(3), now=SERVICE)
    queue.admit(_request(4), now=SERVICE)
    assert [seq for _, seq in _served(queue, 1.0)] == [1, 3]
    queue.admit(_request(5), now=2.0)
    assert _served(queue, 3.0) == [(2.0 + SERVICE, 5)]


def test_without_a_queue_nobody_waits() -> None:
    queue = CommandQueue(None)
    for seq in range(200):
        queue.admit(_request(seq), now=0.5)
    assert _served(queue, 0.5) == [(0.5, seq) for seq in range(200)]


def test_who_waits_can_be_forgotten() -> None:
    queue = CommandQueue(4)
    queue.admit(_request(1), now=0.0)
    queue.clear()
    assert queue.due is None


@given(st.lists(st.floats(0, 0.01), max_size=60), st.integers(1, 5))
def test_service_is_one_by_one_and_in_order(gaps: list[float], places: int) -> None:
    queue, now, served = CommandQueue(places), 0.0, []
    for seq, gap in enumerate(gaps):
        now += gap
        served += _served(queue, now)
        queue.admit(_request(seq), now=now)
    served += _served(queue, now + 1.0)
    times = [when for when, _ in served]
    assert [seq for _, seq in served] == sorted(seq for _, seq in served)
    assert all(b - a > SERVICE * 0.999 for a, b in pairwise(times))
