"""The pace of one node: timeout and window after commands that end in ways chosen by hand and at random."""

from collections.abc import Iterator
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.link.pacing import (
    BACKOFF,
    FIRST_TIMEOUT,
    FIRST_WINDOW,
    GRACE,
    GRAIN,
    LONGEST_BACKOFF,
    LONGEST_TIMEOUT,
    PATIENT_ROUND_TRIPS,
    SHORTEST_PATIENCE,
    SHORTEST_TIMEOUT,
    SLOW_START,
    WIDEST,
    Pace,
)

USUAL = 0.125
"""Seconds that a round trip takes, where nothing else is said."""


class Node:
    """A node and its pace: commands are sent with increasing numbers, and end some seconds later.

    Attributes:
        overtaken: by the last answer.
    """

    def __init__(self, **options: int) -> None:
        self.pace = Pace(**options)
        self.now = 1024.0  # every time here is a sum of powers of two: nothing is rounded
        self.sent_at: dict[int, float] = {}
        self.overtaken: list[int] = []

    def send(self, count: int = 1, **options: bool) -> list[int]:
        """Send so many at once, a moment after whatever happened before; return their numbers."""
        self.now += 2**-10
        numbers = [len(self.sent_at) + place for place in range(count)]
        for number in numbers:
            self.sent_at[number] = self.now
            self.pace.sent(number, now=self.now, **options)
        return numbers

    def fill(self) -> list[int]:
        return self.send(self.pace.window - self.pace.in_flight)

    def answer(self, numbers: list[int], after: float = USUAL, **options: bool) -> list[int]:
        """Answer all these at once; return the window after each."""
        self.now += after
        windows = []
        for number in numbers:
            waited = self.now - self.sent_at[number]
            self.overtaken = self.pace.answered(number, waited, now=self.now, **options)
            windows.append(self.pace.window)
        return windows

    def stay_silent(self, numbers: list[int], after: float = 2.0, **options: bool) -> None:
        self.now += after
        for number in numbers:
            self.pace.silent(number, self.now - self.sent_at[number], now=self.now, **options)

    def grow_to(self, window: int) -> None:
        """Keep the window full and have all answered, until it is so wide; leave nothing in flight."""
        while self.pace.window < window:
            numbers = self.fill()
            self.now += USUAL
            while numbers and self.pace.window < window:
                self.answer([numbers.pop(0)], after=0.0)
            for number in numbers:
                self.pace.forget(number)
        assert (self.pace.window, self.pace.in_flight) == (window, 0)


def by_rfc_6298(round_trips: list[float]) -> tuple[float, float]:
    """Smoothed round trip and variation, in the words of section 2."""
    srtt, rttvar = round_trips[0], round_trips[0] / 2
    for r in round_trips[1:]:
        rttvar = (1 - 1 / 4) * rttvar + 1 / 4 * abs(srtt - r)
        srtt = (1 - 1 / 8) * srtt + 1 / 8 * r
    return srtt, rttvar


def timeout_for(srtt: float, rttvar: float) -> float:
    return min(max(srtt + max(GRAIN, srtt, 4 * rttvar), SHORTEST_TIMEOUT), LONGEST_TIMEOUT)


@pytest.mark.parametrize(
    ("round_trips", "smoothed", "variation"),
    [
        pytest.param([0.5], 0.5, 0.25, id="the first one"),
        pytest.param([0.5, 0.5], 0.5, 0.1875, id="the same again"),
        pytest.param([0.5, 0.5, 0.5], 0.5, 0.140625, id="and again"),
        pytest.param([0.5, 1.0], 0.5625, 0.3125, id="a longer one"),
        pytest.param([0.5, 0.25], 0.46875, 0.25, id="a shorter one"),
        pytest.param([0.25, 0.5, 0.125], 0.26171875, 0.15625, id="up and down"),
    ],
)
def test_round_trips_are_smoothed_as_in_rfc_6298(
    round_trips: list[float], smoothed: float, variation: float
) -> None:
    assert by_rfc_6298(round_trips) == (smoothed, variation)
    node = Node()
    for round_trip in round_trips:
        node.answer(node.send(), round_trip)
    assert node.pace.round_trip == pytest.approx(smoothed)
    assert node.pace.grace == pytest.approx(4 * variation)
    assert node.pace.timeout == pytest.approx(timeout_for(smoothed, variation))


@given(st.lists(st.floats(0.0, 10.0), min_size=1, max_size=30))
def test_any_round_trips_are_smoothed_so(round_trips: list[float]) -> None:
    pace = Pace()
    for number, round_trip in enumerate(round_trips):
        pace.sent(number, now=20.0 * number)
        pace.answered(number, round_trip, now=20.0 * number + round_trip)
    assert pace.round_trip == pytest.approx(by_rfc_6298(round_trips)[0])
    assert pace.timeout == pytest.approx(timeout_for(*by_rfc_6298(round_trips)))


@pytest.mark.parametrize(
    ("round_trip", "timeout"),
    [
        pytest.param(0.0, SHORTEST_TIMEOUT, id="no time at all"),
        pytest.param(LONGEST_TIMEOUT, LONGEST_TIMEOUT, id="long"),
        pytest.param(100.0, LONGEST_TIMEOUT, id="longer than anybody waits"),
    ],
)
def test_the_timeout_has_bounds(round_trip: float, timeout: float) -> None:
    node = Node()
    node.answer(node.send(), round_trip)
    assert node.pace.timeout == timeout


@pytest.mark.parametrize("round_trip", [2**-6, 2**-4, 0.25])
def test_however_steady_a_robot_is_it_is_waited_for_longer(round_trip: float) -> None:
    node = Node()
    for _ in range(80):
        node.answer(node.send(), round_trip)
    assert node.pace.grace == pytest.approx(GRACE)
    assert node.pace.timeout == pytest.approx(timeout_for(round_trip, 0.0))
    assert node.pace.timeout >= round_trip + GRAIN


def test_before_the_first_answer() -> None:
    pace = Pace()
    assert (pace.timeout, pace.round_trip, pace.window, pace.in_flight) == (
        FIRST_TIMEOUT,
        None,
        FIRST_WINDOW,
        0,
    )
    assert pace.grace == GRACE


def test_silences_make_the_timeout_longer() -> None:
    node = Node()
    for times in range(1, 8):
        node.stay_silent(node.send(), after=node.pace.timeout)
        assert node.pace.timeout == pytest.approx(min(LONGEST_BACKOFF, FIRST_TIMEOUT * BACKOFF**times))
    assert node.pace.timeout == LONGEST_BACKOFF
    assert node.pace.round_trip is None


def test_silences_of_one_window_count_once() -> None:
    node = Node()
    node.grow_to(SLOW_START)
    timeout = node.pace.timeout
    first, *others = node.fill()
    node.stay_silent([first], after=1.0)
    node.stay_silent(others, after=0.5)
    assert node.pace.timeout == pytest.approx(min(LONGEST_BACKOFF, timeout * BACKOFF))
    node.stay_silent(node.send(), after=1.0)
    assert node.pace.timeout == pytest.approx(min(LONGEST_BACKOFF, timeout * BACKOFF**2))


def test_the_next_answer_takes_the_longer_timeout_back() -> None:
    node = Node()
    node.answer(node.send(), 0.25)
    for _ in range(10):
        node.stay_silent(node.send())
    assert node.pace.timeout == LONGEST_BACKOFF
    node.answer(node.send(), 0.25)
    assert node.pace.timeout == pytest.approx(timeout_for(*by_rfc_6298([0.25, 0.25])))


def test_the_window_grows_by_one_with_each_answer_at_first() -> None:
    node = Node()
    seen = [node.pace.window]
    while node.pace.window < SLOW_START:
        seen += node.answer(node.fill())
    slow = seen[: seen.index(SLOW_START) + 1]
    assert slow == list(range(FIRST_WINDOW, SLOW_START + 1))


def test_after_halving_it_grows_by_one_with_each_window() -> None:
    node = Node()
    node.grow_to(WIDEST)
    node.stay_silent(node.fill(), expected=True)
    half = node.pace.window
    seen = []
    while node.pace.window < WIDEST:
        seen += node.answer(node.fill())
    answers = seen.index(WIDEST) + 1
    assert sum(range(half, WIDEST)) <= answers <= sum(range(half + 1, WIDEST + 1))


def test_the_window_has_an_end() -> None:
    node = Node()
    seen = [window for _ in range(3 * WIDEST) for window in node.answer(node.fill())]
    assert max(seen) == seen[-1] == WIDEST
    assert {after - before for before, after in pairwise(seen)} == {0, 1}


def test_a_window_that_is_not_filled_does_not_grow() -> None:
    node = Node()
    node.grow_to(4)
    for _ in range(WIDEST):
        node.answer(node.send(3))
    assert node.pace.window == 4
    for _ in range(2):
        node.answer(node.send(4))
    assert node.pace.window > 4


def test_what_was_sent_after_the_window_was_full_proves_nothing() -> None:
    node = Node()
    node.grow_to(2)
    first, second = node.fill()
    node.answer([first], after=USUAL / 2)
    (third,) = node.send()
    node.answer([second], after=USUAL / 2)
    grown = node.pace.window
    node.answer([third], after=USUAL / 2)
    assert node.pace.window == grown


def test_a_missed_answer_that_was_certain_halves_the_window_once() -> None:
    node = Node()
    node.grow_to(WIDEST)
    first, *others = node.fill()
    node.stay_silent([first], expected=True)
    assert node.pace.window == WIDEST // 2
    node.stay_silent(others, after=0.5, expected=True)
    assert node.pace.window == WIDEST // 2
    node.stay_silent(node.fill()[:1], expected=True)
    assert node.pace.window == WIDEST // 4


def test_after_halving_the_window_grows_slowly() -> None:
    node = Node()
    node.grow_to(WIDEST)
    node.stay_silent(node.fill(), expected=True)
    assert node.pace.window == WIDEST // 2
    node.answer(node.fill())
    assert node.pace.window == WIDEST // 2
    node.answer(node.fill())
    assert node.pace.window == WIDEST // 2 + 1


def test_after_halving_there_is_no_slow_start_up_to_where_it_ended_before() -> None:
    node = Node()
    node.grow_to(SLOW_START)
    node.stay_silent(node.fill(), expected=True)
    half = node.pace.window
    assert half == SLOW_START // 2
    assert node.answer(node.fill())[-1] <= half + 1
    node.grow_to(half + 1)
    assert node.answer(node.fill())[-1] <= half + 2


def test_an_unsurprising_silence_leaves_the_window_as_it_is() -> None:
    node = Node()
    node.grow_to(WIDEST)
    node.stay_silent(node.fill())
    assert (node.pace.window, node.pace.in_flight) == (WIDEST, 0)


def test_the_window_never_closes() -> None:
    node = Node()
    for _ in range(10):
        node.stay_silent(node.fill(), expected=True)
        assert node.pace.window == 1
    node.answer(node.fill())
    assert node.pace.window == 2


def test_a_busy_robot_is_asked_less() -> None:
    node = Node()
    node.grow_to(WIDEST)
    first, *others = node.fill()
    assert node.answer([first], busy=True) == [WIDEST // 2]
    assert set(node.answer(others, after=0.0, busy=True)) == {WIDEST // 2}
    assert node.pace.in_flight == 0
    assert node.answer(node.fill()[:1], busy=True) == [WIDEST // 4]


def test_a_busy_answer_overtakes_no_command() -> None:
    node = Node()
    node.grow_to(SLOW_START)
    numbers = node.fill()
    timeout, round_trip = node.pace.timeout, node.pace.round_trip
    node.answer(numbers[-1:], after=2**-10, busy=True)
    assert (node.overtaken, node.pace.in_flight) == ([], len(numbers) - 1)
    assert (node.pace.timeout, node.pace.round_trip) == (timeout, round_trip)


def test_overtaken_commands_leave_the_window() -> None:
    node = Node()
    node.grow_to(SLOW_START)
    first, second, third, last = node.send(4)
    node.answer([third])
    assert (node.overtaken, node.pace.in_flight) == ([first, second], 1)
    node.answer([second])
    assert (node.overtaken, node.pace.in_flight) == ([], 1)
    node.answer([last])
    assert (node.overtaken, node.pace.in_flight) == ([], 0)


def test_answers_in_order_overtake_no_command() -> None:
    node = Node(window=WIDEST)
    for number in node.fill():
        node.answer([number], after=2**-10)
        assert node.overtaken == []
    assert node.pace.in_flight == 0


def test_a_reused_number_is_last_in_order() -> None:
    pace = Pace(window=4)
    for number in (3, 0):
        pace.sent(number, now=0.0)
    pace.forget(3)
    pace.sent(3, now=1.0)
    assert pace.answered(0, 2.0, now=2.0) == []
    assert pace.answered(3, 1.0, now=2.0) == []


def test_the_silence_of_an_overtaken_command_is_no_slowness() -> None:
    node = Node(window=2)
    overtaken, served = node.fill()
    node.answer([served])
    assert node.overtaken == [overtaken]
    timeout = node.pace.timeout
    node.stay_silent([overtaken])
    assert node.pace.timeout == timeout


def test_an_overtaken_command_whose_answer_was_certain_narrows_the_window() -> None:
    node = Node()
    node.grow_to(WIDEST)
    overtaken, served = node.fill()[:2]
    node.answer([served])
    node.stay_silent([overtaken], expected=True)
    assert node.pace.window == WIDEST // 2


def test_a_forgotten_command_takes_no_place() -> None:
    node = Node()
    (number,) = node.send()
    for _ in range(2):
        node.pace.forget(number)
        assert node.pace.in_flight == 0
    node.stay_silent([number])
    assert node.pace.timeout == FIRST_TIMEOUT


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["send", "send", "send", "answer", "answer", "busy", "silent", "expected", "forget"]),
        st.integers(0, 20),
        st.floats(0.0, 5.0),
    ),
    max_size=60,
)


def play(pace: Pace, events: list[tuple[str, int, float]]) -> Iterator[tuple[str, int]]:
    """Let these events happen to numbers asked or not, each some seconds after the last; yield after each."""
    now = 0.0
    sent_at: dict[int, float] = {}
    for kind, number, seconds in events:
        now += seconds
        waited = now - sent_at.get(number, 0.0)
        before = pace.in_flight
        match kind:
            case "send":
                pace.sent(number, now=now)
                sent_at[number] = now
            case "answer" | "busy":
                overtaken = pace.answered(number, waited, now=now, busy=kind == "busy")
                assert number not in overtaken
                assert before - pace.in_flight in {0, len(overtaken) + 1}
            case "silent" | "expected":
                pace.silent(number, waited, now=now, expected=kind == "expected")
            case _:
                pace.forget(number)
        yield kind, before


@given(EVENTS)
def test_whatever_happens_there_are_bounds(events: list[tuple[str, int, float]]) -> None:
    pace = Pace()
    for kind, before in play(pace, events):
        assert 1 <= pace.window <= WIDEST
        assert isinstance(pace.window, int)
        assert SHORTEST_TIMEOUT <= pace.timeout <= LONGEST_TIMEOUT
        assert pace.grace >= GRACE
        assert 0 <= pace.in_flight <= before + (kind == "send")


@given(EVENTS, st.floats(0.001, 100.0), st.integers(1, 255))
def test_whatever_happens_what_was_fixed_stays(
    events: list[tuple[str, int, float]], timeout: float, window: int
) -> None:
    fixed = Pace(timeout, window)
    for _ in play(fixed, events):
        assert (fixed.timeout, fixed.window) == (timeout, window)


@given(EVENTS, st.floats(0.001, 100.0))
def test_a_fixed_timeout_lets_the_window_adapt(events: list[tuple[str, int, float]], timeout: float) -> None:
    free, fixed = Pace(), Pace(timeout)
    for _ in zip(play(free, events), play(fixed, events), strict=True):
        assert (fixed.timeout, fixed.window) == (timeout, free.window)


@given(EVENTS, st.integers(1, 255))
def test_a_fixed_window_lets_the_timeout_adapt(events: list[tuple[str, int, float]], window: int) -> None:
    free, fixed = Pace(), Pace(window=window)
    for _ in zip(play(free, events), play(fixed, events), strict=True):
        assert (fixed.timeout, fixed.window) == (free.timeout, window)


def test_a_command_gets_some_round_trips_from_its_first_attempt_on_unless_a_timeout_was_set() -> None:
    assert Pace().patience == FIRST_TIMEOUT
    quick, slow = Node(), Node()
    quick.answer(quick.send(), 0.01)
    slow.answer(slow.send(), 0.5)
    assert quick.pace.patience == SHORTEST_PATIENCE
    assert slow.pace.patience == PATIENT_ROUND_TRIPS * 0.5
    assert Pace(timeout=0.05).patience == 0.05


def overflow(node: Node, queue: int) -> None:
    """Lose the last command of two bursts that are one longer than a queue takes."""
    for _ in range(2):
        numbers = node.send(queue + 1)
        node.answer(numbers[:-1])
        node.stay_silent(numbers[-1:])
        node.answer(node.send())
        node.pace.lost(numbers[-1])


def test_a_queue_that_overflows_gets_commands_at_equal_distances() -> None:
    node = Node()
    node.grow_to(4)
    overflow(node, 3)
    pace = node.pace
    assert (pace.is_spaced, pace.window) == (True, 3)
    (number,) = node.send()
    assert pace.round_trip is not None
    assert pace.ready_at > node.now + pace.round_trip / 3
    assert pace.crowd(number).is_spaced


def test_the_distance_is_that_of_a_long_round_trip_where_each_waits_for_a_connection_event() -> None:
    node = Node()
    node.grow_to(4)
    overflow(node, 3)
    for waited in (20, 25, 30) * 40:
        node.answer(node.send(), waited / 1000)
    distance = node.pace.ready_at - node.sent_at[max(node.sent_at)]
    assert 0.030 <= distance * node.pace.window <= 0.035


def test_a_command_that_was_silent_before_does_not_hold_the_window_back() -> None:
    for doubtful in (False, True):
        node = Node()
        node.grow_to(4)
        for _ in range(WIDEST):  # one answer, to the last of all that are in flight
            numbers = node.send(node.pace.window, doubtful=doubtful)
            node.answer(numbers[-1:])
        assert node.pace.window == (WIDEST if doubtful else 4)


def test_only_what_was_sent_into_too_many_is_excused() -> None:
    node = Node()
    node.grow_to(4)
    early = node.send(4)
    node.answer(early)
    overflow(node, 3)
    assert [node.pace.overflows(node.pace.crowd(number)) for number in early] == [False, False, False, True]
    assert not node.pace.overflows(node.pace.crowd(node.send()[0]))


def test_an_answer_that_was_only_late_is_no_loss() -> None:
    node = Node()
    late, lost = node.fill()
    node.stay_silent([late, lost])
    node.pace.answered_late(late, took=3.0)
    assert [node.pace.lost(late), node.pace.lost(lost)] == [1, 0]
    node.pace.sent(late, now=node.now)  # its number is used again
    node.stay_silent([late])
    assert node.pace.lost(late) == 0


def test_commands_that_are_not_lost_are_sent_as_soon_as_there_is_a_place() -> None:
    node = Node()
    node.grow_to(WIDEST)
    node.stay_silent(node.fill())
    assert not node.pace.is_spaced
    assert node.pace.ready_at <= node.now
