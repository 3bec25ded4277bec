from collections import Counter
from statistics import median, quantiles
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.simulator.radio import INTERVAL, LONGEST_HOLD, NOTIFICATION_BYTES, PER_EVENT, Radio
from sphero_probe.simulator.settings import Line, Settings, Timing
from tests.support.narrowing import known

BOLT = ROBOTS["bolt"]
FRAMES = [bytes([number] * 30) for number in range(200)]


def _received(**settings: Any) -> list[bytes]:
    radio = Radio(Settings(BOLT, split=30, **settings))
    for frame in FRAMES:
        radio.send(frame, now=0.0)
    return radio.receive(now=0.0)


def _heard(**settings: Any) -> list[bytes]:
    radio = Radio(Settings(BOLT, **settings))
    heard = []
    for frame in FRAMES:
        radio.carry(frame, now=0.0)
        heard.append(radio.take() if radio.due is not None else b"")
    return heard


def test_a_good_line_changes_nothing() -> None:
    assert _received() == FRAMES
    assert _heard() == FRAMES


@given(st.lists(st.binary(min_size=1, max_size=90), max_size=8), st.integers(1, 64))
def test_chunks_add_up_in_order(frames: list[bytes], size: int) -> None:
    radio = Radio(Settings(BOLT, split=size))
    for frame in frames:
        radio.send(frame, now=1.0)
    chunks = radio.receive(now=1.0)
    assert b"".join(chunks) == b"".join(frames)
    assert all(0 < len(chunk) <= size for chunk in chunks)


def test_without_a_split_a_chunk_is_a_small_notification() -> None:
    radio = Radio(Settings(BOLT))
    radio.send(bytes(45), now=0.0)
    assert [len(chunk) for chunk in radio.receive(now=0.0)] == [NOTIFICATION_BYTES, NOTIFICATION_BYTES, 5]


def test_latency_holds_back_and_keeps_order() -> None:
    radio = Radio(Settings(BOLT, latency=0.25))
    assert radio.next_time() is None
    radio.send(b"first", now=10.0)
    radio.send(b"second", now=10.125)
    radio.send(b"from the past", now=9.0)
    assert radio.next_time() == 10.25
    assert radio.receive(now=10.2) == []
    assert radio.receive(now=10.25) == [b"first"]
    assert radio.next_time() == 10.375
    assert radio.receive(now=11.0) == [b"second", b"from the past"]
    assert radio.next_time() is None


@pytest.mark.parametrize("fault", ["loss", "corrupt", "duplicate"])
def test_faults_follow_the_seed(fault: str) -> None:
    first = _received(seed=1, **{fault: 0.3})
    assert first == _received(seed=1, **{fault: 0.3})
    assert first != _received(seed=2, **{fault: 0.3})
    assert first != FRAMES


@pytest.mark.parametrize("fault", ["loss", "corrupt"])
def test_faults_hit_what_the_host_sends_too(fault: str) -> None:
    first = _heard(seed=1, **{fault: 0.3})
    assert first == _heard(seed=1, **{fault: 0.3})
    assert first != _heard(seed=2, **{fault: 0.3})
    assert first != FRAMES


def test_the_host_is_not_heard_twice() -> None:
    assert _heard(duplicate=1.0) == FRAMES


def test_loss_takes_about_the_share_it_should() -> None:
    survivors = _received(loss=0.25)
    assert 110 < len(survivors) < 190
    assert survivors == [frame for frame in FRAMES if frame in survivors]
    assert _received(loss=1.0) == []
    assert _heard(loss=1.0) == [b""] * len(FRAMES)


def test_corruption_changes_one_byte() -> None:
    for sent, got in [
        *zip(FRAMES, _received(corrupt=1.0), strict=True),
        *zip(FRAMES, _heard(corrupt=1.0), strict=True),
    ]:
        assert len(got) == len(sent)
        assert sum(a != b for a, b in zip(sent, got, strict=True)) == 1


def test_duplicates_follow_each_other() -> None:
    assert _received(duplicate=1.0) == [frame for frame in FRAMES for _ in range(2)]


def test_nothing_cannot_be_damaged() -> None:
    radio = Radio(Settings(BOLT, corrupt=1.0))
    radio.carry(b"", now=0.0)
    assert radio.due is None


def _pump(radio: Radio, until: float) -> list[tuple[float, str, bytes]]:
    """What arrives at both ends by some time: (when, "up" or "down", packet)."""
    seen = []
    while (due := radio.next_time()) is not None and due <= until:
        while radio.due is not None and radio.due <= due:
            seen.append((radio.due, "up", radio.take()))
        seen += [(due, "down", packet) for packet in radio.receive(now=due)]
    return seen


@given(
    st.lists(st.tuples(st.floats(0, 3), st.booleans(), st.binary(min_size=1, max_size=70)), max_size=60),
    st.sampled_from([0.0075, 0.03, 0.1]),
    st.integers(1, 6),
    st.sampled_from([0.0, 0.015]),
)
def test_no_event_carries_more_than_it_can(
    traffic: list[tuple[float, bool, bytes]], interval: float, per_event: int, latency: float
) -> None:
    radio = Radio(Settings(BOLT, interval=interval, per_event=per_event, latency=latency))
    radio.connect(now=0.0)
    traffic = sorted(traffic, key=lambda sent: sent[0])
    for now, is_up, data in traffic:
        if is_up:
            radio.carry(data, now=now)
        else:
            radio.send(data, now=now)
    seen = _pump(radio, 1e9)
    load = Counter((round(when / interval), direction) for when, direction, _ in seen)
    assert max(load.values(), default=0) <= per_event
    for when, _, packet in seen:
        assert abs(when / interval - round(when / interval)) < 1e-6
        assert len(packet) <= NOTIFICATION_BYTES
    for direction, is_up in (("up", True), ("down", False)):
        got = b"".join(packet for _, where, packet in seen if where == direction)
        assert got == b"".join(data for _, sent_up, data in traffic if sent_up is is_up)


@given(st.floats(0, 1e5), st.floats(0, 10), st.integers(1, 40))
def test_nothing_travels_in_the_event_in_which_it_was_made(anchor: float, later: float, number: int) -> None:
    radio = Radio(Settings(BOLT, interval=0.03, per_event=1))
    radio.connect(now=anchor)
    now = anchor + later
    for _ in range(number):
        radio.carry(b"ask", now=now)
        heard = known(radio.due)
        assert heard > now
        radio.send(radio.take(), now=heard)
        now = known(radio.next_time())
        assert now > heard
        assert now - heard == pytest.approx(0.03)
        assert radio.receive(now=now) == [b"ask"]


@pytest.mark.parametrize(
    ("settings", "interval", "per_event"),
    [
        pytest.param({"interval": 0.05}, 0.05, PER_EVENT, id="interval alone"),
        pytest.param({"per_event": 2}, INTERVAL, 2, id="size alone"),
    ],
)
def test_half_an_event_is_filled_up(settings: dict[str, Any], interval: float, per_event: int) -> None:
    radio = Radio(Settings(BOLT, **settings))
    radio.connect(now=0.0)
    for number in range(2 * per_event):
        radio.send(bytes([number]), now=0.0)
    assert [when for when, *_ in _pump(radio, 9.0)] == pytest.approx(
        [interval] * per_event + [2 * interval] * per_event
    )


def test_a_late_answer_is_overtaken_by_one_other() -> None:
    radio = Radio(Settings(BOLT, reorder=1.0))
    for answer in (b"1", b"2", b"3", b"4"):
        radio.send(answer, now=0.0, is_answer=True)
    assert radio.receive(now=0.0) == [b"2", b"1", b"4", b"3"]


def test_a_late_answer_comes_though_no_other_does() -> None:
    radio = Radio(Settings(BOLT, reorder=1.0, latency=0.25))
    radio.send(b"answer", now=0.0, is_answer=True)
    radio.send(b"news", now=0.0)
    assert radio.next_time() == LONGEST_HOLD
    assert _pump(radio, 9.0) == [(0.25, "down", b"news"), (LONGEST_HOLD + 0.25, "down", b"answer")]


@given(st.lists(st.tuples(st.floats(0, 0.2), st.booleans()), max_size=40), st.floats(0, 1), st.integers(0, 9))
def test_reordering_keeps_everything(gaps: list[tuple[float, bool]], share: float, seed: int) -> None:
    radio = Radio(Settings(BOLT, reorder=share, seed=seed))
    now, got = 0.0, []
    for number, (gap, is_answer) in enumerate(gaps):
        now += gap
        got += radio.receive(now=now)
        radio.send(bytes([number]), now=now, is_answer=is_answer)
    got += [packet for *_, packet in _pump(radio, now + 1.0)]
    assert sorted(got) == [bytes([number]) for number in range(len(gaps))]
    news = [packet for packet in got if not gaps[packet[0]][1]]
    assert news == sorted(news)


def test_the_order_follows_the_seed() -> None:
    def order(seed: int) -> list[bytes]:
        radio = Radio(Settings(BOLT, reorder=0.3, seed=seed))
        for number in range(100):
            radio.send(bytes([number]), now=0.0, is_answer=True)
        return radio.receive(now=1.0)

    assert order(1) == order(1) != order(2)
    assert order(1) != sorted(order(1)) == [bytes([number]) for number in range(100)]


def test_a_drop_loses_what_is_in_the_air() -> None:
    radio = Radio(Settings(BOLT, latency=0.25, reorder=1.0))
    radio.send(b"old", now=0.0)
    radio.send(b"held", now=0.25, is_answer=True)
    radio.send(b"new", now=0.25)
    radio.carry(b"never heard", now=0.25)
    radio.drop(now=0.25)
    assert _pump(radio, 9.0) == [(0.25, "down", b"old")]
    radio.send(b"old", now=1.0)
    radio.connect(now=2.0)
    assert radio.next_time() is None


def test_measured_round_trips_are_those_of_the_capture() -> None:
    """Independent: the figures of the capture, in milliseconds, as they were counted there."""
    radio = Radio(Settings(BOLT, timing=Timing.MEASURED))
    took = []
    for second in range(2000):
        radio.send(b"ab", now=float(second))
        arrived = known(radio.next_time())
        assert radio.receive(now=second + 0.5) == [b"a", b"b"]  # byte by byte
        took.append((arrived - second) * 1000)
    tenths = quantiles(took, n=10)
    assert 18.3 <= min(took) <= max(took) <= 71.0
    assert median(took) == pytest.approx(38.8, abs=1.0)
    assert tenths[0] == pytest.approx(24.7, abs=2.0)
    assert tenths[-1] == pytest.approx(53.0, abs=2.5)


def test_measured_answers_stay_in_order() -> None:
    radio = Radio(Settings(BOLT, timing=Timing.MEASURED))
    for frame in FRAMES:
        radio.send(frame[:1], now=0.0)
    assert b"".join(radio.receive(now=1.0)) == bytes(range(len(FRAMES)))


@pytest.mark.parametrize("baud", [9600, 115_200])
def test_a_uart_takes_ten_bits_for_a_byte(baud: int) -> None:
    radio = Radio(Settings(BOLT, line=Line.UART, baud=baud))
    radio.carry(bytes(18), now=1.0)
    radio.carry(bytes(6), now=1.0)
    assert radio.due == pytest.approx(1.0 + 180 / baud)
    assert radio.take() == bytes(18)
    assert radio.due == pytest.approx(1.0 + 240 / baud)
    radio.send(bytes(12), now=2.0)
    assert radio.next_time() == pytest.approx(1.0 + 240 / baud)
    radio.take()
    assert radio.next_time() == pytest.approx(2.0 + 120 / baud)
