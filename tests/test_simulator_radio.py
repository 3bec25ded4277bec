import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.simulator.radio import NOTIFICATION_BYTES, Radio
from sphero_probe.simulator.settings import Settings

BOLT = ROBOTS["bolt"]
FRAMES = [bytes([number] * 30) for number in range(200)]


def _received(**settings):
    radio = Radio(Settings(BOLT, split=30, **settings))
    for frame in FRAMES:
        radio.send(frame, now=0.0)
    return radio.receive(now=0.0)


def _heard(**settings):
    radio = Radio(Settings(BOLT, **settings))
    return [radio.carry(frame) for frame in FRAMES]


def test_a_good_line_changes_nothing():
    assert _received() == FRAMES
    assert _heard() == FRAMES


@given(st.lists(st.binary(min_size=1, max_size=90), max_size=8), st.integers(1, 64))
def test_chunks_add_up_in_order(frames, size):
    radio = Radio(Settings(BOLT, split=size))
    for frame in frames:
        radio.send(frame, now=1.0)
    chunks = radio.receive(now=1.0)
    assert b"".join(chunks) == b"".join(frames)
    assert all(0 < len(chunk) <= size for chunk in chunks)


def test_without_a_split_a_chunk_is_a_small_notification():
    radio = Radio(Settings(BOLT))
    radio.send(bytes(45), now=0.0)
    assert [len(chunk) for chunk in radio.receive(now=0.0)] == [NOTIFICATION_BYTES, NOTIFICATION_BYTES, 5]


def test_latency_holds_back_and_keeps_order():
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
def test_faults_follow_the_seed(fault):
    first = _received(seed=1, **{fault: 0.3})
    assert first == _received(seed=1, **{fault: 0.3})
    assert first != _received(seed=2, **{fault: 0.3})
    assert first != FRAMES


@pytest.mark.parametrize("fault", ["loss", "corrupt"])
def test_faults_hit_what_the_host_sends_too(fault):
    first = _heard(seed=1, **{fault: 0.3})
    assert first == _heard(seed=1, **{fault: 0.3})
    assert first != _heard(seed=2, **{fault: 0.3})
    assert first != FRAMES


def test_the_host_is_not_heard_twice():
    assert _heard(duplicate=1.0) == FRAMES


def test_loss_takes_about_the_share_it_should():
    survivors = _received(loss=0.25)
    assert 110 < len(survivors) < 190
    assert survivors == [frame for frame in FRAMES if frame in survivors]
    assert _received(loss=1.0) == []
    assert _heard(loss=1.0) == [b""] * len(FRAMES)


def test_corruption_changes_one_byte():
    for sent, got in [
        *zip(FRAMES, _received(corrupt=1.0), strict=True),
        *zip(FRAMES, _heard(corrupt=1.0), strict=True),
    ]:
        assert len(got) == len(sent)
        assert sum(a != b for a, b in zip(sent, got, strict=True)) == 1


def test_duplicates_follow_each_other():
    assert _received(duplicate=1.0) == [frame for frame in FRAMES for _ in range(2)]


def test_nothing_cannot_be_damaged():
    assert Radio(Settings(BOLT, corrupt=1.0)).carry(b"") == b""
