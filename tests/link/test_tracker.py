"""The tracker with answers in every order: to which command each belongs, and which are too late."""

from collections.abc import Iterable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from sphero_probe.link.exchange import Answered, Exchange, LateResponse, Silent, Unsolicited
from sphero_probe.link.tracker import _REMEMBERED, QUIET, REUSE_AFTER_ANSWER, REUSE_AFTER_SILENCE, Tracker
from sphero_probe.protocol.codec import Decoder
from sphero_probe.protocol.packets import Command, Malformed, Notification, Packet, Request, Response, Role
from sphero_probe.protocol.v1 import V1
from sphero_probe.protocol.v2 import V2, V2Codec
from tests.support.narrowing import every, known, only

BATTERY = Command(0x13, 0x10)
VOLTAGE = Command(0x13, 0x03)
PING = Command(0x00, 0x01)
OK, NO_TARGET, TARGET_UNAVAILABLE = 0x00, 0x09, 0x0A


def answer_to(
    command: Command,
    seq: int,
    payload: bytes = b"",
    code: int = OK,
    source: int | None = None,
    target: int | None = None,
) -> Response:
    return Response(seq, code, payload, command.did, command.cid, source, target, 0x09)


def say(tracker: Tracker, *packets: Packet, now: float = 0.0) -> list[Exchange | Unsolicited]:
    """What the tracker makes of these packets, heard in one piece."""
    return list(tracker.hear(b"".join(V2.frame_of(packet) for packet in packets), now=now))


def kinds(events: Iterable[Exchange | Unsolicited]) -> list[type]:
    return [type(event) for event in events]


def asked(*commands: Command, timeout: float = 1.0) -> Tracker:
    """A tracker that asked these commands at 0 s."""
    tracker = Tracker(V2)
    for command in commands:
        tracker.ask(command, now=0.0, timeout=timeout)
    return tracker


def test_what_an_answer_says() -> None:
    tracker = Tracker(V2)
    seq, frame = tracker.ask(BATTERY, now=100.0, timeout=1.0)
    assert frame == V2.encode_command(BATTERY, seq)
    (answered,) = tracker.hear(bytes.fromhex("8d09131000005f74d8"), now=100.25)
    assert answered == Answered(
        BATTERY,
        seq,
        frame,
        answer_to(BATTERY, seq, b"\x5f"),
        bytes.fromhex("8d09131000005f74d8"),
        0.25,
    )
    assert tracker.next_deadline() is None


@pytest.mark.parametrize(
    ("target", "source", "client", "fits"),
    [
        pytest.param(None, None, None, True, id="no addresses"),
        pytest.param(None, 0x01, None, True, id="SID although none was asked for"),
        pytest.param(None, 0x02, 0x21, True, id="any node where none was named"),
        pytest.param(0x11, 0x01, 0x11, True, id="swapped"),
        pytest.param(0x01, 0x01, 0x21, True, id="swapped, over UART"),
        pytest.param(0x11, 0x01, None, True, id="SID only"),
        pytest.param(0x11, None, 0x11, True, id="TID only"),
        pytest.param(0x11, None, None, True, id="both dropped"),
        pytest.param(0x11, 0x11, 0x01, True, id="echoed, not swapped"),
        pytest.param(0x11, 0x31, None, True, id="another port, same node"),
        pytest.param(0x12, 0x02, 0x11, True, id="node 2"),
        pytest.param(0x12, None, 0x11, True, id="node 2, SID dropped"),
        pytest.param(0x12, 0x01, 0x11, False, id="node 1 instead of 2"),
        pytest.param(0x11, 0x02, None, False, id="node 2 instead of 1"),
        pytest.param(0x1F, 0x1E, None, False, id="node 14 instead of 15"),
        pytest.param(0x10, 0x01, 0x11, True, id="wildcard, node 1"),
        pytest.param(0x10, 0x02, 0x11, True, id="wildcard, node 2"),
        pytest.param(0x00, 0x05, None, True, id="wildcard, any node"),
    ],
)
def test_matching_on_the_node(target: int | None, source: int | None, client: int | None, fits: bool) -> None:
    command = BATTERY._replace(target=target)
    tracker = asked(command)
    (event,) = say(tracker, answer_to(command, 0, source=source, target=client))
    assert isinstance(event, Answered if fits else LateResponse)
    assert (tracker.next_deadline() is None) == fits
    if isinstance(event, LateResponse):
        assert event.earlier is None
        assert kinds(say(tracker, answer_to(command, 0, source=target))) == [Answered]


@pytest.mark.parametrize("code", [NO_TARGET, TARGET_UNAVAILABLE])
@pytest.mark.parametrize("source", [None, 0x01, 0x11, 0x02, 0x12])
def test_another_node_answers_for_the_missing_one(code: int, source: int | None) -> None:
    command = BATTERY._replace(target=0x12)
    (event,) = say(asked(command), answer_to(command, 0, code=code, source=source, target=0x11))
    assert isinstance(event, Answered)
    assert event.response.code == code


@pytest.mark.parametrize(
    "response",
    [
        pytest.param(Response(0, OK, b"", 0x13, 0x11), id="other CID"),
        pytest.param(Response(0, OK, b"", 0x14, 0x10), id="other DID"),
        pytest.param(Response(1, OK, b"", 0x13, 0x10), id="other SEQ"),
        pytest.param(Response(254, OK, b"", 0x13, 0x10), id="SEQ never used"),
        pytest.param(Response(255, OK, b"", 0x13, 0x10), id="SEQ of notifications"),
        pytest.param(Response(0, NO_TARGET, b"", 0x13, 0x11), id="no such node, of another command"),
    ],
)
def test_foreign_answers_settle_nothing(response: Response) -> None:
    tracker = asked(BATTERY)
    (event,) = say(tracker, response)
    assert isinstance(event, LateResponse)
    assert event.response._replace(flags=0) == response
    assert event.received == V2.encode_response(response)
    assert event.earlier is None
    assert kinds(say(tracker, answer_to(BATTERY, 0))) == [Answered]


def test_answers_in_any_order() -> None:
    tracker = asked(BATTERY, VOLTAGE, BATTERY)
    events = say(
        tracker,
        answer_to(BATTERY, 2, b"\x02"),
        answer_to(BATTERY, 0, b"\x00"),
        answer_to(VOLTAGE, 1, b"\x01"),
    )
    assert [(event.seq, event.command, event.response.payload) for event in every(Answered, events)] == [
        (2, BATTERY, b"\x02"),
        (0, BATTERY, b"\x00"),
        (1, VOLTAGE, b"\x01"),
    ]


def test_a_response_with_the_sequence_number_of_notifications_is_no_notification() -> None:
    real = bytes.fromhex("8d21011106ff0064656339353461656430663603d8")
    (event,) = asked(BATTERY).hear(real, now=0.0)
    assert isinstance(event, LateResponse)
    assert event.received == real


def test_unsolicited_packets() -> None:
    tracker = asked(BATTERY)
    awake = Notification(0x13, 0x11, b"", 1, None, 0xFF, 0x28)
    spoilt = Malformed(bytes.fromhex("8d09130d0000d7d8"), "checksum 0xd7, expected 0xd6")
    events = say(tracker, awake, spoilt, answer_to(BATTERY, 0), awake)
    assert events == [awake, spoilt, events[2], awake]
    assert isinstance(events[2], Answered)


def test_a_notification_of_the_same_pair_settles_nothing() -> None:
    tracker = asked(BATTERY)
    assert kinds(say(tracker, Notification(0x13, 0x10, b"\x5f", seq=0))) == [Notification]
    assert tracker.next_deadline() == 1.0


def test_a_duplicate_belongs_to_what_was_answered() -> None:
    tracker = asked(BATTERY)
    first, second, third = say(tracker, *[answer_to(BATTERY, 0, b"\x5f")] * 3)
    assert isinstance(first, Answered)
    assert isinstance(second, LateResponse)
    assert isinstance(third, LateResponse)
    assert (second.earlier, third.earlier) == (first, first)
    assert second.received == first.received


def test_a_late_answer_belongs_to_what_was_silent() -> None:
    tracker = asked(BATTERY)
    (silent,) = tracker.expire(now=1.5)
    assert silent == Silent(BATTERY, 0, V2.encode_command(BATTERY, 0), 1.5)
    again, _ = tracker.ask(BATTERY, now=1.5, timeout=1.0)
    assert again != 0
    late, answered = say(tracker, answer_to(BATTERY, 0, b"\x01"), answer_to(BATTERY, again, b"\x02"), now=2.0)
    assert late == LateResponse(
        answer_to(BATTERY, 0, b"\x01"), V2.encode_response(answer_to(BATTERY, 0, b"\x01")), silent, 2.0
    )
    assert isinstance(answered, Answered)
    assert (answered.seq, answered.response.payload, answered.rtt) == (again, b"\x02", 0.5)
    assert kinds(say(tracker, answer_to(BATTERY, 0), now=3.0)) == [LateResponse]


def test_a_foreign_answer_is_not_matched_to_an_earlier_command() -> None:
    tracker = asked(BATTERY._replace(target=0x11))
    list(tracker.expire(now=2.0))
    event = only(LateResponse, say(tracker, answer_to(VOLTAGE, 0), now=2.0))
    assert event.earlier is None
    event = only(LateResponse, say(tracker, answer_to(BATTERY, 0, source=0x12), now=2.0))
    assert event.earlier is None
    event = only(LateResponse, say(tracker, answer_to(BATTERY, 0, source=0x01), now=2.0))
    assert isinstance(event.earlier, Silent)


def test_a_reused_number_forgets_the_earlier_command() -> None:
    tracker = asked(*[BATTERY] * 255)
    say(tracker, answer_to(BATTERY, 0))
    assert tracker.ask(BATTERY, now=REUSE_AFTER_ANSWER, timeout=1.0)[0] == 0
    (event,) = say(tracker, answer_to(BATTERY, 0), now=REUSE_AFTER_ANSWER)
    assert isinstance(event, Answered)
    duplicate = only(LateResponse, say(tracker, answer_to(BATTERY, 0), now=REUSE_AFTER_ANSWER))
    assert duplicate.earlier is event


def test_a_number_reused_for_another_command_forgets_nothing() -> None:
    tracker = asked(*[BATTERY] * 255)
    (first,) = say(tracker, answer_to(BATTERY, 0, b"\x01"))
    assert tracker.ask(VOLTAGE, now=0.0, timeout=1.0)[0] == 0
    late, second = say(tracker, answer_to(BATTERY, 0, b"\x01"), answer_to(VOLTAGE, 0, b"\x02"))
    assert isinstance(late, LateResponse)
    assert (late.earlier, late.response.payload) == (first, b"\x01")
    assert isinstance(second, Answered)
    assert (second.command, second.response.payload) == (VOLTAGE, b"\x02")


@pytest.mark.parametrize("waiting", [True, False])
def test_a_late_answer_finds_its_own_command_though_its_number_was_reused(waiting: bool) -> None:
    tracker = asked(*[BATTERY] * 255)
    silents = list(tracker.expire(now=1.0))
    sounds = Command(0x1A, 0x10)
    for command in (VOLTAGE, sounds):
        assert tracker.ask(command, now=1.0, timeout=1.0)[0] == (0 if command == VOLTAGE else 1)
    settled = [] if waiting else list(tracker.expire(now=2.0))
    late = say(tracker, *[answer_to(BATTERY, seq) for seq in (1, 0, 254)], now=2.5)
    assert [event.earlier for event in every(LateResponse, late)] == [silents[1], silents[0], silents[254]]
    others = say(tracker, answer_to(VOLTAGE, 0), answer_to(sounds, 1), now=2.5)
    assert kinds(others) == [Answered if waiting else LateResponse] * 2
    assert [event.earlier for event in others if isinstance(event, LateResponse)] == settled


def test_sequence_numbers_run_from_0_to_254_and_start_over() -> None:
    tracker = Tracker(V2)
    seqs = []
    for number in range(600):
        now = number * REUSE_AFTER_ANSWER
        seq, frame = tracker.ask(BATTERY, now=now, timeout=1.0)
        seqs.append(seq)
        assert frame == V2.encode_command(BATTERY, seq)
        assert kinds(say(tracker, answer_to(BATTERY, seq), now=now)) == [Answered]
    assert seqs == [number % 255 for number in range(600)]


def test_waiting_numbers_are_not_used_again() -> None:
    tracker = Tracker(V2)
    kept = [tracker.ask(VOLTAGE, now=0.0, timeout=1e6)[0] for _ in range(3)]
    for number in range(600):
        now = number * REUSE_AFTER_ANSWER
        seq, _ = tracker.ask(BATTERY, now=now, timeout=1.0)
        assert seq not in kept
        say(tracker, answer_to(BATTERY, seq), now=now)
    assert kinds(say(tracker, *[answer_to(VOLTAGE, seq) for seq in kept])) == [Answered] * 3


def test_all_numbers_waiting() -> None:
    tracker = asked(*[BATTERY] * 254)
    assert tracker.free_at(BATTERY, 0.0) == 0.0
    tracker.ask(BATTERY, now=0.0, timeout=1.0)
    assert tracker.free_at(BATTERY, 0.0) == float("inf")
    with pytest.raises(RuntimeError, match="sequence number"):
        tracker.ask(BATTERY, now=0.0, timeout=1.0)
    assert tracker.next_deadline() == 1.0


def test_numbers_of_silent_commands_are_not_reused_for_a_while() -> None:
    tracker = asked(*[BATTERY] * 255)
    assert len(list(tracker.expire(now=1.0))) == 255
    assert tracker.free_at(BATTERY, 1.0) == 1.0 + REUSE_AFTER_SILENCE
    with pytest.raises(RuntimeError, match="sequence number"):
        tracker.ask(BATTERY, now=0.5 + REUSE_AFTER_SILENCE, timeout=1.0)
    assert tracker.free_at(BATTERY, 1.0 + REUSE_AFTER_SILENCE) == 1.0 + REUSE_AFTER_SILENCE
    assert tracker.free_at(BATTERY, 50.0) == 50.0
    assert tracker.ask(BATTERY, now=1.0 + REUSE_AFTER_SILENCE, timeout=1.0)[0] == 0
    assert tracker.ask(BATTERY, now=1.0 + REUSE_AFTER_SILENCE, timeout=1.0)[0] == 1


@pytest.mark.parametrize(
    ("command", "may"),
    [
        pytest.param(BATTERY, False, id="the same"),
        pytest.param(BATTERY._replace(payload=b"\x01"), False, id="other payload: answers do not tell it"),
        pytest.param(BATTERY._replace(target=0x12), False, id="other node: answers may drop it"),
        pytest.param(VOLTAGE, True, id="other CID"),
        pytest.param(Command(0x14, 0x10), True, id="other DID"),
    ],
)
def test_another_command_may_use_a_resting_number_where_answers_name_commands(
    command: Command, may: bool
) -> None:
    tracker = asked(*[BATTERY] * 255)
    list(tracker.expire(now=1.0))
    assert tracker.free_at(command, 1.0) == (1.0 if may else 1.0 + REUSE_AFTER_SILENCE)
    if may:
        assert tracker.ask(command, now=1.0, timeout=1.0)[0] == 0
        event = only(Answered, say(tracker, answer_to(command, 0), now=1.0))
        assert (type(event), event.command) == (Answered, command)
    else:
        with pytest.raises(RuntimeError, match="sequence number"):
            tracker.ask(command, now=1.0, timeout=1.0)


@pytest.mark.parametrize("silent", [True, False])
def test_no_command_may_use_a_resting_number_where_answers_name_none(silent: bool) -> None:
    tracker = Tracker(V1)
    everyone = len(V1.sequence_numbers)
    for _ in range(everyone):
        tracker.ask(PING, now=0.0, timeout=1.0)
    if silent:
        assert kinds(tracker.expire(now=1.0)) == [Silent] * everyone
        rested = 1.0 + REUSE_AFTER_SILENCE
    else:
        for seq in V1.sequence_numbers:
            assert kinds(tracker.hear(V1.encode_response(Response(seq, OK)), now=1.0)) == [Answered]
        rested = 1.0 + REUSE_AFTER_ANSWER
    for command in (PING, Command(0x02, 0x20)):
        assert tracker.free_at(command, 1.0) == rested
        with pytest.raises(RuntimeError, match="sequence number"):
            tracker.ask(command, now=1.0, timeout=1.0)
    late = only(LateResponse, tracker.hear(V1.encode_response(Response(V1.sequence_numbers[3], OK)), now=1.0))
    assert late.earlier is not None
    assert (late.earlier.seq, late.earlier.command) == (V1.sequence_numbers[3], PING)
    assert tracker.ask(Command(0x02, 0x20), now=rested, timeout=1.0)[0] == V1.sequence_numbers[0]


def test_the_first_rested_number_tells_when_one_is_free() -> None:
    tracker = Tracker(V2)
    for number in range(255):
        tracker.ask(BATTERY, now=0.0, timeout=1.0 if number == 77 else 2.0)
    assert [event.seq for event in every(Silent, tracker.expire(now=1.5))] == [77]
    assert tracker.free_at(BATTERY, 1.5) == 1.5 + REUSE_AFTER_SILENCE
    list(tracker.expire(now=2.0))
    assert tracker.free_at(BATTERY, 2.0) == 1.5 + REUSE_AFTER_SILENCE
    assert tracker.ask(BATTERY, now=1.5 + REUSE_AFTER_SILENCE, timeout=1.0)[0] == 77
    assert tracker.free_at(BATTERY, 1.5 + REUSE_AFTER_SILENCE) == 2.0 + REUSE_AFTER_SILENCE


def test_numbers_of_answered_commands_are_reused_soon() -> None:
    tracker = asked(*[BATTERY] * 254)
    list(tracker.expire(now=1.0))
    seq, _ = tracker.ask(BATTERY, now=1.0, timeout=1.0)
    assert kinds(say(tracker, answer_to(BATTERY, seq), now=1.25)) == [Answered]
    assert tracker.free_at(BATTERY, 1.25) == 1.25 + REUSE_AFTER_ANSWER
    with pytest.raises(RuntimeError, match="sequence number"):
        tracker.ask(BATTERY, now=1.25, timeout=1.0)
    assert kinds(say(tracker, answer_to(BATTERY, seq), now=1.25)) == [LateResponse]
    assert tracker.ask(BATTERY, now=1.25 + REUSE_AFTER_ANSWER, timeout=1.0)[0] == seq


def test_a_command_that_cannot_be_encoded_takes_no_number() -> None:
    tracker = Tracker(V2)
    with pytest.raises(ValueError, match="at most"):
        tracker.ask(Command(0x10, 0x00, bytes(5000)), now=0.0, timeout=1.0)
    assert tracker.next_deadline() is None
    assert tracker.ask(BATTERY, now=0.0, timeout=1.0)[0] == 0


def test_deadlines() -> None:
    tracker = Tracker(V2)
    assert tracker.next_deadline() is None
    assert list(tracker.expire(now=1e9)) == []
    tracker.ask(BATTERY, now=0.0, timeout=2.0)
    tracker.ask(VOLTAGE, now=0.5, timeout=1.0)
    assert tracker.next_deadline() == 1.5
    assert list(tracker.expire(now=1.25)) == []
    assert [event.seq for event in every(Silent, tracker.expire(now=1.5))] == [1]
    assert tracker.next_deadline() == 2.0
    say(tracker, answer_to(BATTERY, 0), now=1.75)
    assert tracker.next_deadline() is None
    assert list(tracker.expire(now=5.0)) == []


@pytest.mark.parametrize(
    ("deadline", "first", "second"),
    [
        pytest.param(0.25, 0.25, 0.25, id="before both"),
        pytest.param(1.5, 1.0, 1.5, id="between"),
        pytest.param(2.0, 1.0, 2.0, id="the same"),
        pytest.param(9.0, 1.0, 2.0, id="later: no command waits longer"),
    ],
)
def test_deadlines_are_only_shortened(deadline: float, first: float, second: float) -> None:
    tracker = asked(BATTERY)
    tracker.ask(VOLTAGE, now=0.0, timeout=2.0)
    tracker.ask(BATTERY, now=0.0, timeout=7.0)
    tracker.shorten_deadlines([1, 0], deadline=deadline)
    assert tracker.next_deadline() == first
    ends = {
        silent.seq: silent.waited
        for now in (0.25, 1.0, 1.5, 2.0, 7.0)
        for silent in every(Silent, tracker.expire(now=now))
    }
    assert ends == {0: first, 1: second, 2: 7.0}


def test_a_command_that_does_not_wait_has_no_deadline_to_shorten() -> None:
    tracker = asked(BATTERY, VOLTAGE, BATTERY)
    say(tracker, answer_to(BATTERY, 0))
    tracker.shorten_deadlines([0, 77], deadline=0.5)
    assert tracker.next_deadline() == 1.0
    tracker.shorten_deadlines([], deadline=0.5)
    assert kinds(tracker.expire(now=0.5)) == []


def test_a_late_answer_finds_a_command_with_a_shortened_deadline() -> None:
    tracker = asked(BATTERY, timeout=100.0)
    tracker.shorten_deadlines([0], deadline=0.5)
    (silent,) = tracker.expire(now=0.5)
    late = only(LateResponse, say(tracker, answer_to(BATTERY, 0), now=0.5 + REUSE_AFTER_SILENCE - 0.125))
    assert late.earlier is silent


def test_an_answer_at_the_last_moment_counts() -> None:
    tracker = asked(BATTERY)
    assert kinds(say(tracker, answer_to(BATTERY, 0), now=7.0)) == [Answered]
    assert list(tracker.expire(now=7.0)) == []


def test_an_incomplete_frame_is_given_up_when_the_line_is_quiet() -> None:
    tracker = asked(BATTERY)
    frame = V2.encode_response(answer_to(BATTERY, 0))
    assert list(tracker.hear(frame[:5], now=1.0 - QUIET)) == []
    half, silent = tracker.expire(now=1.0)
    assert isinstance(half, Malformed)
    assert half.raw == frame[:5]
    assert isinstance(silent, Silent)
    (rest,) = tracker.hear(frame[5:], now=1.5)
    assert isinstance(rest, Malformed)
    assert rest.raw == frame[5:]


def test_an_incomplete_frame_is_kept_while_the_line_is_busy() -> None:
    tracker = asked(BATTERY)
    frame = V2.encode_response(answer_to(BATTERY, 0))
    assert list(tracker.hear(frame[:5], now=1.0 - QUIET / 2)) == []
    (silent,) = tracker.expire(now=1.0)
    assert isinstance(silent, Silent)
    (late,) = tracker.hear(frame[5:], now=1.0)
    assert isinstance(late, LateResponse)
    assert late.earlier == silent


def test_an_incomplete_frame_is_kept_while_no_command_is_overdue() -> None:
    tracker = asked(BATTERY, timeout=10.0)
    frame = V2.encode_response(answer_to(BATTERY, 0))
    assert list(tracker.hear(frame[:5], now=0.0)) == []
    assert list(tracker.expire(now=9.0)) == []
    assert kinds(tracker.hear(frame[5:], now=9.0)) == [Answered]


class WithoutIds(V2Codec):
    """A codec whose answers name no command, and whose decoder says whatever it was given to say."""

    sequence_numbers = range(4)
    answers_name_commands = False

    def __init__(self) -> None:
        self.coming: list[Packet] = []
        self.held_back: list[Packet] = []

    def decoder(self, role: Role) -> Decoder:
        return self

    def feed(self, data: bytes) -> list[Packet]:
        said, self.coming = self.coming, []
        return said

    def give_up(self) -> list[Packet]:
        said, self.held_back = self.held_back, []
        return said

    def encode_command(self, command: Command, seq: int, **_: object) -> bytes:
        return bytes([seq])

    def frame_of(self, packet: Packet) -> bytes:
        return b"answer"


def test_answers_that_name_no_command_are_matched_on_the_sequence_number() -> None:
    codec = WithoutIds()
    tracker = Tracker(codec)
    assert [tracker.ask(command, now=0.0, timeout=1.0)[0] for command in (BATTERY, VOLTAGE)] == [0, 1]
    codec.coming = [Response(1, OK), Response(3, OK), Response(0, OK), Response(0, OK)]
    events = list(tracker.hear(b"!", now=0.0))
    assert kinds(events) == [Answered, LateResponse, Answered, LateResponse]
    answers = every(Answered, events[::2])
    assert [answer.command for answer in answers] == [VOLTAGE, BATTERY]
    assert [late.earlier for late in every(LateResponse, events[1::2])] == [None, answers[1]]


def test_every_codec_has_its_own_numbers() -> None:
    tracker = Tracker(WithoutIds())
    assert [tracker.ask(BATTERY, now=0.0, timeout=1.0)[0] for _ in range(4)] == [0, 1, 2, 3]
    assert tracker.free_at(BATTERY, 0.0) == float("inf")


def test_packets_behind_an_incomplete_frame_are_heard_before_the_deadline() -> None:
    codec = WithoutIds()
    tracker = Tracker(codec)
    for command in (BATTERY, VOLTAGE):
        tracker.ask(command, now=0.0, timeout=1.0)
    codec.held_back = [Malformed(b"!", "half a frame"), Response(0, OK), Notification(None, 0x03)]
    events = list(tracker.expire(now=1.0))
    assert kinds(events) == [Malformed, Answered, Notification, Silent]
    _, answered, _, silent = events
    assert isinstance(answered, Answered)
    assert isinstance(silent, Silent)
    assert [answered.command, silent.command] == [BATTERY, VOLTAGE]
    codec.held_back = [Response(1, OK)]
    assert list(tracker.expire(now=100.0)) == []


def test_a_command_from_the_robot_is_no_answer() -> None:
    codec = WithoutIds()
    tracker = Tracker(codec)
    tracker.ask(BATTERY, now=0.0, timeout=1.0)
    codec.coming = [Request(BATTERY, 0)]
    assert kinds(tracker.hear(b"!", now=0.0)) == [Malformed]
    assert tracker.next_deadline() == 1.0


class Fluent(WithoutIds):
    """A codec whose answers name their commands, and that costs next to nothing."""

    sequence_numbers = range(255)
    answers_name_commands = True


def held(tracker: Tracker) -> int:
    """How many things a tracker remembers, whatever for."""
    return sum(len(part) for part in vars(tracker).values() if hasattr(part, "__len__"))


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("every", "most"),
    [
        pytest.param(None, 3 * _REMEMBERED, id="all answered"),
        pytest.param(10, 3 * (_REMEMBERED + REUSE_AFTER_SILENCE / 2**-10 / 10), id="one in ten silent"),
        pytest.param(25_000, 3 * _REMEMBERED, id="one silent"),
    ],
)
def test_memory_does_not_grow(every: int | None, most: float) -> None:
    codec = Fluent()
    tracker = Tracker(codec)
    now, sizes = 0.0, []
    for number in range(50_000):
        now += 2**-10
        command = Command(number % 200, number // 200 % 256)
        seq, _ = tracker.ask(command, now=now, timeout=2**-10)
        if every and number % every == 0:
            assert len(list(tracker.expire(now=now + 2**-10))) == 1
        else:
            codec.coming = [Response(seq, OK, b"", command.did, command.cid)]
            assert len(list(tracker.hear(b"!", now=now))) == 1
        if number % 1000 == 999:
            sizes.append(held(tracker))
    assert max(sizes) <= most
    assert max(sizes[25:]) <= max(sizes[:25]) * 1.01
    tracker.ask(BATTERY, now=now + 2 * REUSE_AFTER_SILENCE, timeout=1.0)
    assert held(tracker) == 1


def settle(tracker: Tracker, command: Command, now: float) -> Answered:
    """Ask and answer one command at once; return the exchange."""
    codec = tracker._codec
    assert isinstance(codec, Fluent)
    seq, _ = tracker.ask(command, now=now, timeout=1.0)
    codec.coming = [Response(seq, OK, b"", command.did, command.cid)]
    return only(Answered, tracker.hear(b"!", now=now))


def test_what_rests_is_not_forgotten_however_much_is_settled_meanwhile() -> None:
    codec = Fluent()
    tracker = Tracker(codec)
    tracker.ask(BATTERY, now=0.0, timeout=1.0)
    (silent,) = tracker.expire(now=1.0)
    for number in range(_REMEMBERED + 10):
        settle(tracker, Command(number // 250, number % 250), 1.0 + number / _REMEMBERED)
    codec.coming = [Response(0, OK, b"", *BATTERY[:2])]
    late = only(LateResponse, tracker.hear(b"!", now=0.5 + REUSE_AFTER_SILENCE))
    assert late.earlier is silent
    seqs = {tracker.ask(BATTERY, now=0.5 + REUSE_AFTER_SILENCE, timeout=1.0)[0] for _ in range(254)}
    assert 0 not in seqs


def test_what_was_settled_again_is_remembered_from_then_on() -> None:
    codec = Fluent()
    codec.sequence_numbers = range(1)
    tracker = Tracker(codec)
    settle(tracker, BATTERY, 0.0)
    last = settle(tracker, BATTERY, REUSE_AFTER_SILENCE - 1.0)
    settle(tracker, VOLTAGE, REUSE_AFTER_SILENCE + 1.0)
    codec.coming = [Response(0, OK, b"", *BATTERY[:2])]
    late = only(LateResponse, tracker.hear(b"!", now=REUSE_AFTER_SILENCE + 1.0))
    assert late.earlier is last


def test_what_is_answered_often_is_remembered_once() -> None:
    tracker = Tracker(V2)
    for number in range(600):
        seq, _ = tracker.ask(BATTERY, now=number / 8, timeout=1.0)
        (last,) = say(tracker, answer_to(BATTERY, seq), now=number / 8)
    assert held(tracker) <= 4 * REUSE_AFTER_SILENCE * 8
    late = only(LateResponse, say(tracker, answer_to(BATTERY, seq), now=600 / 8))
    assert late.earlier is last


@given(st.lists(st.binary(max_size=30), max_size=5))
def test_nothing_a_robot_says_raises(pieces: list[bytes]) -> None:
    tracker = asked(BATTERY, VOLTAGE)
    events = [event for piece in pieces for event in tracker.hear(piece, now=0.5)]
    assert all(isinstance(event, Answered | LateResponse | Malformed | Notification) for event in events)


PAIRS = [
    Command(did, cid, b"", target)
    for did in (0x10, 0x13)
    for cid in (0x00, 0x10)
    for target in (None, 0x11, 0x12)
]
STYLES = ["both addresses", "source only", "no addresses"]


class UnreliableRobot(RuleBasedStateMachine):
    """A robot that answers late, twice, in any order, from the wrong node, in pieces, or never.

    The payload of each answer names the question that it answers. No answer arrives once the sequence
    number of its silent question may be reused, or that of its answered question was: then the two could not
    be told apart.
    """

    def __init__(self) -> None:
        super().__init__()
        self.tracker = Tracker(V2)
        self.now = 0.0
        self.questions: dict[int, tuple[Command, int]] = {}
        self.deadlines: dict[int, float] = {}
        self.waiting: dict[int, int] = {}
        self.reusable_at: dict[tuple[int, int, int], float] = {}
        self.settled: dict[int, Answered | Silent] = {}
        self.settled_at: dict[int, float] = {}

    def handle(self, question: int) -> tuple[int, int, int]:
        command, seq = self.questions[question]
        return seq, command.did, command.cid

    def answerable(self) -> list[int]:
        """The questions that the robot may still answer, or answer again."""
        newest = {self.handle(question): question for question in self.questions}
        return [
            question
            for handle, question in newest.items()
            if not isinstance(self.settled.get(question), Silent) or self.reusable_at[handle] > self.now
        ]

    def settle(self, event: Answered | Silent, rest: float) -> int:
        """Book how a question ended; return it."""
        question = self.waiting.pop(event.seq)
        assert self.questions[question] == (event.command, event.seq)
        self.settled[question], self.settled_at[question] = event, self.now
        self.reusable_at[self.handle(question)] = self.now + rest
        return question

    def take(self, events: Iterable[Exchange | Unsolicited]) -> list[Exchange | Unsolicited]:
        """Check what the tracker says against what the robot knows, and book it."""
        said: list[Exchange | Unsolicited] = []
        for event in events:
            match event:
                case Answered(response=response):
                    question = self.settle(event, REUSE_AFTER_ANSWER)
                    assert question == int.from_bytes(response.payload), "credited to another command"
                case Silent():
                    self.settle(event, REUSE_AFTER_SILENCE)
                case LateResponse(response=response, earlier=earlier):
                    question = int.from_bytes(response.payload)
                    if earlier or self.now < self.settled_at.get(question, self.now) + REUSE_AFTER_SILENCE:
                        assert earlier is self.settled.get(question), "laid at another command"
            if not isinstance(event, Malformed):
                said.append(event)
        return said

    def hear(self, response: Response, cut: int = 0) -> list[Exchange | Unsolicited]:
        frame = V2.encode_response(response)
        said = self.take(self.tracker.hear(frame[:cut], now=self.now))
        return said + self.take(self.tracker.hear(frame[cut:], now=self.now))

    @rule(command=st.sampled_from(PAIRS), timeout=st.sampled_from([0.25, 1.0, 4.0]))
    def ask(self, command: Command, timeout: float) -> None:
        resting = {
            seq
            for (seq, did, cid), until in self.reusable_at.items()
            if until > self.now and (did, cid) == (command.did, command.cid)
        }
        free = set(range(255)) - self.waiting.keys() - resting
        assert (self.tracker.free_at(command, self.now) == self.now) == bool(free)
        if not free:
            with pytest.raises(RuntimeError):
                self.tracker.ask(command, now=self.now, timeout=timeout)
            return
        assert self.claim(command, timeout) in free

    def claim(self, command: Command, timeout: float) -> int:
        seq, _ = self.tracker.ask(command, now=self.now, timeout=timeout)
        assert seq not in self.waiting
        question = len(self.questions) + 1
        self.questions[question] = (command, seq)
        self.deadlines[question] = self.now + timeout
        self.waiting[seq] = question
        return seq

    @rule(count=st.integers(100, 255), command=st.sampled_from(PAIRS))
    def ask_many(self, count: int, command: Command) -> None:
        while count and self.tracker.free_at(command, self.now) == self.now:
            count -= 1
            self.claim(command, 0.25)
        self.ask(command, 0.25)

    @rule(numbers=st.sets(st.integers(0, 20)), seconds=st.sampled_from([0.0, 0.125, 0.5, 9.0]))
    def shorten_deadlines(self, numbers: set[int], seconds: float) -> None:
        self.tracker.shorten_deadlines(numbers, deadline=self.now + seconds)
        for seq in numbers & self.waiting.keys():
            question = self.waiting[seq]
            self.deadlines[question] = min(self.deadlines[question], self.now + seconds)

    @rule(seconds=st.sampled_from([0.25, 0.5, 1.0, 4.0, REUSE_AFTER_SILENCE]))
    def let_time_pass(self, seconds: float) -> None:
        self.now += seconds
        overdue = [question for question in self.waiting.values() if self.deadlines[question] <= self.now]
        said = self.take(self.tracker.expire(now=self.now))
        assert kinds(said) == [Silent] * len(overdue)
        assert all(isinstance(self.settled[question], Silent) for question in overdue)

    @precondition(lambda self: bool(self.answerable()))
    @rule(data=st.data(), style=st.sampled_from(STYLES), cut=st.integers(0, 20), times=st.integers(1, 2))
    def answer(self, data: st.DataObject, style: str, cut: int, times: int) -> None:
        question = data.draw(st.sampled_from(self.answerable()))
        command, seq = self.questions[question]
        due = self.waiting.get(seq) == question
        source = None if style == "no addresses" else (command.target or 0x11) & 0x0F
        client = 0x11 if style == "both addresses" else None
        response = answer_to(command, seq, question.to_bytes(4), source=source, target=client)
        said = [event for _ in range(times) for event in self.hear(response, cut)]
        assert kinds(said) == [Answered if due else LateResponse, LateResponse][:times]

    @precondition(lambda self: any(self.questions[question][0].target for question in self.waiting.values()))
    @rule(data=st.data())
    def answer_from_the_wrong_node(self, data: st.DataObject) -> None:
        addressed = [question for question in self.waiting.values() if self.questions[question][0].target]
        question = data.draw(st.sampled_from(addressed))
        command, seq = self.questions[question]
        response = answer_to(command, seq, question.to_bytes(4), source=known(command.target) ^ 0x03)
        assert kinds(self.hear(response)) == [LateResponse]
        assert self.waiting[seq] == question

    @rule(seq=st.integers(0, 255), command=st.sampled_from([Command(0x77, 0x00), Command(0x13, 0x77)]))
    def answer_what_was_never_asked(self, seq: int, command: Command) -> None:
        assert kinds(self.hear(answer_to(command, seq, bytes(4)))) == [LateResponse]

    @rule(noise=st.lists(st.sampled_from([0x00, 0x8D, 0xAB, 0xD8, 0x13]), min_size=1, max_size=6).map(bytes))
    def make_noise(self, noise: bytes) -> None:
        assert self.take(self.tracker.hear(noise, now=self.now)) == []

    @invariant()
    def next_deadline_is_the_first_one(self) -> None:
        deadlines = [self.deadlines[question] for question in self.waiting.values()]
        assert self.tracker.next_deadline() == min(deadlines, default=None)


TestUnreliableRobot = UnreliableRobot.TestCase
TestUnreliableRobot.settings = settings(max_examples=25, stateful_step_count=30, deadline=None)


@pytest.mark.parametrize(
    ("tolerance", "answer", "words"),
    [
        pytest.param(
            "source", answer_to(BATTERY, 0, b"\x57", source=0x15), "they come from node 5", id="another node"
        ),
        pytest.param(
            "seq", answer_to(BATTERY, 200, b"\x57"), "they carry another sequence number", id="another number"
        ),
    ],
)
def test_a_constant_difference_is_accepted_where_that_was_asked_for(
    tolerance: str, answer: Response, words: str
) -> None:
    for tolerate, kind in (((tolerance,), Answered), ((), LateResponse)):
        tracker = Tracker(V2, tolerate)
        tracker.ask(BATTERY._replace(target=0x11), now=0.0, timeout=1.0)
        (event,) = tracker.hear(V2.encode_response(answer), now=0.5)
        assert isinstance(event, kind)
        if isinstance(event, Answered):
            assert event.response.payload == b"\x57"
        assert tracker.tolerated == ({words: 1} if tolerate else {})


def test_an_answer_with_the_flags_of_a_command_is_accepted_where_that_was_asked_for() -> None:
    raw = V2.encode_notification(Notification(BATTERY.did, BATTERY.cid, b"\x00\x57", seq=0, flags=0x0A))
    for tolerate, kind in ((("flags",), Answered), ((), Notification)):
        tracker = Tracker(V2, tolerate)
        tracker.ask(BATTERY, now=0.0, timeout=1.0)
        (event,) = tracker.hear(raw, now=0.5)
        assert isinstance(event, kind)
        if isinstance(event, Answered):
            assert (event.response.code, event.response.payload) == (0, b"\x57")
        assert tracker.tolerated == ({"they lack the flag of a response": 1} if tolerate else {})
