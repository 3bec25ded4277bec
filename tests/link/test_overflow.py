"""Which losses are those of a full queue: compared with a model of such a queue and of a bad radio."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.link.overflow import Overflow


def told_by(
    queue: int, window: int, losing: float, seed: int, *, share: float = 1 / 4
) -> tuple[Overflow, int]:
    """Let a queue take the first commands of every window, and a radio lose some; return what is learned.

    Args:
        queue: commands of a window that it takes.
        window: commands that are sent at once.
        losing: share that the radio loses.
        seed: of the radio.
        share: of lost commands from which on a queue overflows.
    """
    radio, overflow, excused = Random(seed), Overflow(share), 0
    for _ in range(40):
        for place in range(1, window + 1):
            if place > queue or radio.random() < losing:
                excused += overflow.lost(place)
            else:
                overflow.answered(place)
    return overflow, excused


@pytest.mark.parametrize("queue", range(1, 9))
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("losing", [0.0, 0.02])
def test_the_ceiling_is_what_the_queue_takes(queue: int, losing: float, seed: int) -> None:
    overflow, excused = told_by(queue, queue + 3, losing, seed)
    assert overflow.ceiling == queue
    assert excused >= 3 * 40


@given(st.integers(1, 12), st.sampled_from([0.0, 0.01]), st.integers(0, 20))
def test_a_radio_that_loses_little_has_no_ceiling(window: int, losing: float, seed: int) -> None:
    overflow, excused = told_by(window, window, losing, seed)
    assert (overflow.ceiling, excused) == (float("inf"), 0)


@pytest.mark.parametrize("losing", [0.5, 0.8])
def test_a_radio_that_loses_much_of_everything_has_no_ceiling(losing: float) -> None:
    overflow, _ = told_by(12, 12, losing, 1)
    assert overflow.ceiling > 1


def test_every_loss_is_excused_once() -> None:
    overflow = Overflow(1 / 4)
    for level in (1, 2, 3):
        overflow.answered(level)
    assert [overflow.lost(4), overflow.lost(5), overflow.lost(6), overflow.lost(2)] == [0, 2, 1, 0]
    assert overflow.ceiling == 3


def test_after_many_answers_one_more_is_tried_again() -> None:
    overflow = Overflow(1 / 4)
    for level in (1, 2, 3, 4):
        overflow.answered(level)
    for _ in range(4):
        overflow.lost(4)
    assert overflow.ceiling == 3
    for _ in range(300):
        overflow.answered(3)
    assert overflow.ceiling == 4
