"""V1 robots as a host hears them: answers, messages, sleep, streams, resets."""

import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS, commands_of, lookup, notification_row
from sphero_probe.catalogue.leds import led_commands
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.sensors import Masks, masks_after, streaming_fields
from sphero_probe.protocol.packets import Command, Generation, Malformed, Notification, Response, Role
from sphero_probe.protocol.v1 import V1
from sphero_probe.simulator import Executed, FakeRobot, Settings, Strict
from tests.support.fake_robot import ask, code_of, fake, said_by, sample_of, tell
from tests.support.narrowing import every, known
from tests.support.tables import rows

V1_ROBOTS = [robot for robot in ROBOTS.values() if robot.generation is Generation.V1]
MODELS = [pytest.param(robot, id=robot.key) for robot in V1_ROBOTS]
READS = [
    pytest.param(robot, row, id=f"{robot.key} {row.name}")
    for robot in V1_ROBOTS
    for row in commands_of(robot)
    if row.kind is Kind.COMMAND and row.risk is Risk.READ
]
PING, SLEEP = Command(0x00, 0x01), Command(0x00, 0x22, bytes(5))
BOOTLOADER, MAIN = Command(0x00, 0x30), Command(0x01, 0x04)
WILL_SLEEP, DID_SLEEP = 0x05, 0x14


def _heard(robot: FakeRobot, now: float) -> list[int | None]:
    """The ids of the messages that have come by then."""
    return [packet.cid for packet in said_by(robot, now) if isinstance(packet, Notification)]


@pytest.mark.parametrize(
    ("model", "sent", "answer"),
    [
        pytest.param("sphero", "ffff000152 01ab", "ffff00520 1ac", id="ping of the maker's description"),
        pytest.param("bb8", "ffff770003 0184", "ffff090301f2", id="no such device"),
        pytest.param("ollie", "ffff00ee040 10c", "ffff040401f6", id="no such command"),
        pytest.param("sprk-plus", "ffff00010502aa4d", "ffff060501f3", id="a ping takes nothing"),
        pytest.param("sprk", "fffe000152 01ab", "", id="not asked for an answer"),
        pytest.param("bb8", "fffd000152 01ab", "ffff005201ac", id="the timer goes on, an answer comes"),
    ],
)
def test_frames_byte_for_byte(model: str, sent: str, answer: str) -> None:
    robot = fake(model)
    robot.hear(bytes.fromhex(sent.replace(" ", "")), now=0.0)
    assert b"".join(robot.speak(now=0.0)).hex() == answer.replace(" ", "")


@pytest.mark.parametrize("word", ["bb8", "bb-8", "ollie", "sprk-plus", "SPRK+", "sphero", "sprk"])
def test_every_v1_robot_can_be_had(word: str) -> None:
    assert code_of(fake(word), 0x00, 0x01) == 0


@pytest.mark.parametrize("model", MODELS)
def test_what_does_not_exist(model: Robot) -> None:
    robot = FakeRobot(Settings(model))
    for payload in (b"", bytes(11), bytes(40)):
        assert code_of(robot, 0x77, 0x00, payload) == 0x09
        assert code_of(robot, 0x02, 0xF0, payload) == 0x04


@pytest.mark.parametrize("model", MODELS)
def test_wrong_lengths(model: Robot) -> None:
    executed: list[Executed] = []
    robot = FakeRobot(Settings(model), executed.append)
    for fact in robot.truth():
        for length in range(30):
            if not fact.lengths.accepts(length):
                assert code_of(robot, fact.did, fact.cid, bytes(length)) == 0x06
    assert executed == []


@pytest.mark.parametrize(
    ("strict", "did", "cid", "length", "code"),
    [
        pytest.param("exact", 0x00, 0x20, 11, 6, id="exact: a read with surplus"),
        pytest.param("minimum", 0x00, 0x20, 11, 0, id="minimum: a read with surplus"),
        pytest.param("minimum", 0x02, 0x20, 2, 6, id="minimum: a colour with too little"),
        pytest.param("none", 0x02, 0x20, 2, 0, id="none: a colour with too little"),
        pytest.param("exact", 0x02, 0x11, 11, 6, id="exact: between two lengths that are right"),
        pytest.param("exact", 0x02, 0x11, 9, 0, id="exact: without the extended mask"),
        pytest.param("exact", 0x02, 0x11, 13, 0, id="exact: with it"),
        pytest.param("none", 0x77, 0x00, 11, 9, id="none: no such device"),
        pytest.param("none", 0x02, 0xF0, 11, 4, id="none: no such command"),
    ],
)
def test_strictness(strict: str, did: int, cid: int, length: int, code: int) -> None:
    executed: list[Executed] = []
    robot = fake(f"bb8?strict={strict}", executed.append)
    assert code_of(robot, did, cid, bytes(length)) == code
    assert [(run.did, run.cid, run.payload) for run in executed] == (
        [(did, cid, bytes(length))] if code == 0 else []
    )


def test_length_may_mask_existence() -> None:
    robot = fake("bb8?mask=1")
    assert [code_of(robot, 0x02, 0xF0, payload) for payload in (bytes(11), b"")] == [6, 4]


@pytest.mark.parametrize(
    ("command", "flags", "codes", "executed"),
    [
        pytest.param(Command(0x00, 0x20), {}, [0], 1, id="asked"),
        pytest.param(Command(0x00, 0x20), {"answer": False}, [], 1, id="not asked"),
        pytest.param(Command(0x00, 0xF0), {}, [4], 0, id="asked, error"),
        pytest.param(Command(0x00, 0xF0), {"answer": False}, [], 0, id="not asked, error"),
    ],
)
def test_who_gets_an_answer(
    command: Command, flags: dict[str, bool], codes: list[int], executed: int
) -> None:
    ledger: list[Executed] = []
    robot = fake("ollie", ledger.append)
    assert [packet.code for packet in every(Response, tell(robot, command, **flags))] == codes
    assert len(ledger) == executed


@rows(READS)
def test_every_documented_read_answers_and_decodes(model: Robot, row: CommandRow) -> None:
    robot = FakeRobot(Settings(model, seed=5))
    response = ask(robot, row.did, row.cid, sample_of(row))
    assert response.code == 0
    if row.response is not None:
        decoded = row.response.decode(response.payload)
        assert (decoded.problem, decoded.rest) == ("", b"")


@pytest.mark.unmeasured
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(10))
def test_readings_and_what_follows_decode_with_any_seed(model: Robot, seed: int) -> None:
    for row in commands_of(model):
        robot = FakeRobot(Settings(model, seed=seed))
        for packet in tell(robot, Command(row.did, row.cid, sample_of(row))):
            if isinstance(packet, Notification):
                meant = known(notification_row(model.generation, None, packet.cid, model))
                assert model.key in meant.nodes
                assert known(meant.response).decode(packet.payload).problem == ""
            elif isinstance(packet, Response) and packet.code == 0 and row.response:
                assert row.response.decode(packet.payload).problem == ""


@pytest.mark.parametrize("seed", range(10))
def test_readings_are_plausible(seed: int) -> None:
    robot = fake(f"bb8?seed={seed}")
    record, state, volts, charges, since = struct.unpack(">2B3H", ask(robot, 0x00, 0x20).payload)
    assert (record, state in (1, 2, 3)) == (1, True)
    assert 720 <= volts <= 820
    assert max(charges, since) < 1000
    (
        record,
        *_,
    ) = struct.unpack(">8B", ask(robot, 0x00, 0x02).payload)
    assert record == 1
    low, critical = struct.unpack(">2H", ask(robot, 0x00, 0x23).payload)
    assert critical < low < volts
    degrees, tenths = ask(robot, 0x02, 0x16).payload
    assert 18 <= degrees <= 36
    assert tenths < 10


@pytest.mark.parametrize("model", MODELS)
def test_the_seed_makes_the_robot(model: Robot) -> None:
    twins = [FakeRobot(Settings(model, seed=1)) for _ in range(2)]
    other = FakeRobot(Settings(model, seed=2))
    answers = [
        [ask(robot, 0x00, cid).payload for cid in (0x02, 0x11, 0x20, 0x23)] for robot in (*twins, other)
    ]
    assert answers[0] == answers[1] != answers[2]
    assert twins[0].name == twins[1].name != other.name
    assert twins[0].address == twins[1].address != other.address


@pytest.mark.parametrize("model", MODELS)
def test_name_and_address_are_told(model: Robot) -> None:
    robot = FakeRobot(Settings(model, seed=3))
    assert robot.name.startswith(model.prefix or "Sphero-")
    row = known(lookup(model.generation, 0x00, 0x11, model))
    assert row.response is not None
    told = row.response.decode(ask(robot, 0x00, 0x11).payload).fields
    assert told == {"name": robot.name, "address": robot.address.replace(":", "")}


def test_another_name() -> None:
    robot = fake("bb8")
    assert code_of(robot, 0x00, 0x10, b"Poe's droid of the Resistance\0") == 0
    assert robot.name == "Poe's droid of the Resistance"
    assert ask(robot, 0x00, 0x11).payload[:16] == b"Poe's droid of t"


@pytest.mark.parametrize("model", MODELS)
def test_leds(model: Robot) -> None:
    robot = FakeRobot(Settings(model))
    assert robot.leds == {"main_red": 0, "main_green": 0, "main_blue": 0, "back": 0}
    for command in led_commands(model, {"front": (1, 2, 3), "back": (4, 4, 4)}):
        assert code_of(robot, command.did, command.cid, command.payload) == 0
    assert robot.leds == {"main_red": 1, "main_green": 2, "main_blue": 3, "back": 4}
    assert code_of(robot, 0x02, 0x20, bytes((9, 8, 7))) == 0
    assert robot.leds == {"main_red": 9, "main_green": 8, "main_blue": 7, "back": 4}


def test_only_a_colour_that_is_to_be_kept_is_told_again() -> None:
    robot = fake("sphero")
    own = ask(robot, 0x02, 0x22).payload
    assert code_of(robot, 0x02, 0x20, b"\1\2\3\0") == 0
    assert ask(robot, 0x02, 0x22).payload == own
    assert code_of(robot, 0x02, 0x20, b"\4\5\6\1") == 0
    assert code_of(robot, 0x02, 0x20, b"\7\x08\x09") == 0
    assert ask(robot, 0x02, 0x22).payload == b"\4\5\6"


def test_a_setting_is_told_by_its_getter() -> None:
    robot = fake("ollie")
    assert code_of(robot, 0x02, 0x35, bytes.fromhex("00000009")) == 0
    assert ask(robot, 0x02, 0x36).payload.hex() == "00000009"
    assert code_of(robot, 0x02, 0x42, b"\1") == 0
    assert ask(robot, 0x02, 0x44).payload == b"\1"


def test_the_locator_is_where_it_was_told_to_be() -> None:
    robot = fake("bb8")
    assert ask(robot, 0x02, 0x15).payload == bytes(10)
    assert code_of(robot, 0x02, 0x13, struct.pack(">BhhH", 0, -5, 300, 0)) == 0
    assert struct.unpack(">5h", ask(robot, 0x02, 0x15).payload) == (-5, 300, 0, 0, 0)


def test_times_are_those_of_the_caller() -> None:
    answer = ask(fake("bb8"), 0x00, 0x51, b"\0\0\0\7", now=2.5)
    assert struct.unpack(">3I", answer.payload) == (7, 2500, 2500)


@pytest.mark.parametrize(
    ("model", "command", "message", "payload"),
    [
        pytest.param("bb8", Command(0x02, 0x09, b"\1\0\0\0"), 0x0B, "06", id="self level, success"),
        pytest.param("bb8", Command(0x02, 0x09, b"\0\0\0\0"), 0x0B, "04", id="self level, aborted"),
        pytest.param("bb8", SLEEP, 0x14, "", id="did sleep"),
    ],
)
def test_some_commands_bring_a_message(model: str, command: Command, message: int, payload: str) -> None:
    response, news = tell(fake(model), command)
    assert isinstance(response, Response)
    assert response.code == 0
    assert (news.did, news.cid, news.payload.hex()) == (None, message, payload)


def test_diagnostics_come_as_text() -> None:
    robot = fake("bb8")
    response, news = tell(robot, Command(0x00, 0x40))
    assert isinstance(response, Response)
    assert (response.code, response.payload, news.cid) == (0, b"", 0x02)
    text = (
        known(known(notification_row(Generation.V1, None, 0x02, None)).response)
        .decode(news.payload)
        .fields["text"]
    )
    assert isinstance(text, str)
    assert robot.name in text
    assert text.isascii()
    assert text.count("\r\n") > 1


@pytest.mark.parametrize(
    ("did", "cid", "payload", "message", "size"),
    [
        pytest.param(0x02, 0x40, b"\0", 0x04, 254, id="factory configuration"),
        pytest.param(0x02, 0x40, b"\1", 0x04, 254, id="user configuration"),
        pytest.param(0x02, 0x46, b"", 0x0D, 0x440, id="soul"),
    ],
)
def test_blocks_come_as_messages(did: int, cid: int, payload: bytes, message: int, size: int) -> None:
    robot = fake("sphero")
    response, news = tell(robot, Command(did, cid, payload))
    assert isinstance(response, Response)
    assert (response.code, response.payload) == (0, b"")
    assert (news.cid, len(news.payload)) == (message, size)
    assert tell(robot, Command(did, cid, payload))[1] == news


def test_power_messages_are_switched() -> None:
    robot = fake("bb8")
    response, news = tell(robot, Command(0x00, 0x21, b"\1"))
    assert isinstance(response, Response)
    assert (response.code, news.cid) == (0, 0x01)
    assert news.payload == ask(robot, 0x00, 0x20).payload[1:2]
    assert [packet.code for packet in every(Response, tell(robot, Command(0x00, 0x21, b"\0")))] == [0]


def test_no_collision_comes_by_itself() -> None:
    robot = fake("bb8")
    assert code_of(robot, 0x02, 0x12, bytes((1, 40, 60, 40, 60, 10))) == 0
    assert _heard(robot, 300.0) == []


@pytest.mark.parametrize(
    ("model", "did", "cid", "payload", "code"),
    [
        pytest.param("bb8", 0x02, 0x33, bytes((9, 0, 0, 0)), 7, id="no such motor mode"),
        pytest.param("bb8", 0x02, 0x40, b"\2", 7, id="no such block"),
        pytest.param("bb8", 0x00, 0x25, b"\0\x3b", 7, id="too short a timeout"),
        pytest.param("bb8", 0x02, 0x08, b"\0\1", 8, id="chassis id, in the factory only"),
        pytest.param("bb8", 0x00, 0x42, b"", 8, id="counters, in the developer mode only"),
        pytest.param("sphero", 0x02, 0x4B, bytes(9), 0x0B, id="cores, with the password only"),
        pytest.param("sphero", 0x02, 0x47, bytes(0x404), 0x0B, id="the soul, with the password only"),
        pytest.param("sphero", 0x02, 0x48, b"\1", 0, id="a refill wants no password"),
        pytest.param("bb8", 0x02, 0x30, bytes((80, 0, 90, 1)), 0, id="roll"),
        pytest.param("bb8", 0x02, 0x30, bytes((80, 0, 90, 1, 1)), 0, id="roll backwards"),
    ],
)
def test_values_and_states_that_are_refused(
    model: str, did: int, cid: int, payload: bytes, code: int
) -> None:
    executed: list[Executed] = []
    robot = fake(model, executed.append)
    assert code_of(robot, did, cid, payload) == code
    assert bool(executed) == (code == 0)


def test_hidden_commands_answer_like_any_other() -> None:
    executed: list[Executed] = []
    robot = fake("bb8?hidden=30&seed=4", executed.append)
    hidden = [fact for fact in robot.truth() if fact.hidden]
    assert len(hidden) == 30
    for fact in hidden:
        right = bytes(fact.lengths.minimum)
        assert code_of(robot, fact.did, fact.cid, right) == 0
        assert executed[-1] == Executed(1, fact.did, fact.cid, right, fact.risk)
    assert len(executed) == len(hidden)


def test_sleep_is_deaf_to_everything_on_the_line() -> None:
    executed: list[Executed] = []
    robot = fake("bb8", executed.append)
    tell(robot, SLEEP)
    assert robot.asleep
    assert tell(robot, PING) == []
    assert tell(robot, Command(0x13, 0x0D)) == []
    assert len(executed) == 1
    robot.wake(now=1.0)
    assert (robot.asleep, code_of(robot, 0x00, 0x01, now=1.0)) == (False, 0)


def test_sleep_for_a_while() -> None:
    robot = fake("ollie")
    tell(robot, Command(0x00, 0x22, struct.pack(">HBH", 30, 0, 0)))
    assert robot.next_time() == 30.0
    assert tell(robot, PING, now=29.0) == []
    assert code_of(robot, 0x00, 0x01, now=30.0) == 0


def test_deep_sleep_is_for_good() -> None:
    robot = fake("ollie")
    tell(robot, Command(0x00, 0x22, struct.pack(">HBH", 0xFFFF, 0, 0)))
    robot.wake(now=1.0)
    assert robot.asleep
    assert tell(robot, PING, now=1.0) == []
    assert robot.next_time() is None


@pytest.mark.parametrize("model", MODELS)
def test_whom_nobody_asks_warns_and_sleeps(model: Robot) -> None:
    robot = FakeRobot(Settings(model))
    assert code_of(robot, 0x00, 0x01, now=100.0) == 0
    assert robot.next_time() == 690.0
    assert _heard(robot, 689.0) == []
    assert _heard(robot, 690.0) == [WILL_SLEEP]
    assert not robot.asleep
    assert robot.next_time() == 700.0
    assert (_heard(robot, 700.0), robot.asleep) == ([DID_SLEEP], True)
    assert robot.next_time() is None
    assert tell(robot, PING, now=701.0) == []


def test_both_messages_come_to_one_who_listens_late() -> None:
    robot = fake("bb8")
    assert _heard(robot, 0.0) == []
    assert _heard(robot, 9999.0) == [WILL_SLEEP, DID_SLEEP]


def test_a_command_after_the_warning_keeps_it_awake() -> None:
    robot = fake("bb8")
    tell(robot, PING, now=0.0)
    assert _heard(robot, 595.0) == [WILL_SLEEP]
    tell(robot, PING, now=595.0)
    assert _heard(robot, 1184.0) == []
    assert _heard(robot, 1185.0) == [WILL_SLEEP]


def test_a_command_that_is_no_activity_does_not() -> None:
    robot = fake("bb8")
    tell(robot, PING, now=0.0)
    assert [packet.code for packet in every(Response, tell(robot, PING, now=580.0, activity=False))] == [0]
    assert _heard(robot, 600.0) == [WILL_SLEEP, DID_SLEEP]


def test_another_inactivity_timeout() -> None:
    robot = fake("bb8")
    assert code_of(robot, 0x00, 0x25, b"\0\x3c", now=0.0) == 0
    assert _heard(robot, 49.0) == []
    assert _heard(robot, 50.0) == [WILL_SLEEP]
    assert _heard(robot, 60.0) == [DID_SLEEP]


def test_who_was_woken_sleeps_again() -> None:
    robot = fake("bb8")
    tell(robot, SLEEP)
    assert robot.next_time() is None
    robot.wake(now=1000.0)
    assert _heard(robot, 1600.0) == [WILL_SLEEP, DID_SLEEP]


def _stream(
    robot: FakeRobot,
    divisor: int,
    frames: int,
    mask: int,
    packets: int = 0,
    extended: int = 0,
    now: float = 0.0,
) -> Masks:
    payload = struct.pack(">HHIBI", divisor, frames, mask, packets, extended)
    assert code_of(robot, 0x02, 0x11, payload, now=now) == 0
    return masks_after(Generation.V1, Masks(), Command(0x02, 0x11, payload))


def test_streaming_follows_the_clock_of_the_caller() -> None:
    robot = fake("bb8")
    masks = _stream(robot, 40, 1, 0x0007_0000, now=100.0)
    assert robot.next_time() == pytest.approx(100.1)
    packets = said_by(robot, 100.35)
    assert [(packet.did, packet.cid) for packet in packets] == [(None, 0x03)] * 3
    for packet in packets:
        decoded = streaming_fields(Generation.V1, masks, packet.payload)
        assert decoded.problem == ""
        angles: dict[str, Any] = decoded.fields
        assert all(abs(angles[name]) <= 9 for name in ("pitch", "roll", "yaw"))
    _stream(robot, 40, 1, 0, now=100.4)
    assert robot.next_time() == pytest.approx(690.4)


def test_a_stream_of_several_frames_a_packet() -> None:
    robot = fake("ollie")
    masks = _stream(robot, 4, 10, 0x0000_2000, packets=2, extended=0x1000_0000)
    packets = said_by(robot, 5.0)
    assert len(packets) == 2
    for packet in packets:
        fields: dict[str, Any] = streaming_fields(Generation.V1, masks, packet.payload).fields
        assert all(0.94 < upwards < 1.06 for upwards in fields["accelerometer_z"])
        assert all(0.98 < w <= 1.0 for w in fields["quaternion_w"])
        assert [len(values) for values in fields.values()] == [10, 10]


@pytest.mark.parametrize(
    ("divisor", "frames", "mask", "code"),
    [
        pytest.param(0, 1, 0x70000, 7, id="divided by nothing"),
        pytest.param(1, 0, 0x70000, 7, id="empty packets"),
        pytest.param(1, 0xFFFF, 0x70000, 7, id="packets beyond any buffer"),
        pytest.param(0, 0, 0, 0, id="no sensor: off"),
        pytest.param(0xFFFF, 1, 0xFFFFFFFF, 0, id="all sensors"),
    ],
)
def test_streams_that_make_no_sense(divisor: int, frames: int, mask: int, code: int) -> None:
    robot = fake("bb8")
    assert code_of(robot, 0x02, 0x11, struct.pack(">HHIB", divisor, frames, mask, 0)) == code


def test_sleep_ends_a_stream() -> None:
    robot = fake("bb8")
    _stream(robot, 400, 1, 0x0007_0000)
    heard = _heard(robot, 1000.0)
    assert heard[-1] == DID_SLEEP
    assert heard.count(WILL_SLEEP) == 1
    assert set(heard) == {0x03, WILL_SLEEP, DID_SLEEP}
    assert robot.next_time() is None


def test_a_jump_into_the_bootloader_leaves_nothing_else() -> None:
    robot = fake("bb8")
    tell(robot, Command(0x02, 0x21, b"\xff"))
    robot.hear(V1.encode_command(BOOTLOADER, 1), now=0.0)
    said = b"".join(robot.speak(now=0.0))
    assert said == V1.encode_response(Response(1, 0)) + b"u>"
    assert robot.leds["back"] == 0
    assert code_of(robot, 0x00, 0x01) == 0x09
    assert code_of(robot, 0x02, 0x30, bytes(5)) == 0x09
    assert robot.next_time() is None
    assert code_of(robot, MAIN.did, MAIN.cid) == 0
    assert code_of(robot, 0x00, 0x01) == 0


def test_a_prompt_comes_before_the_next_packet() -> None:
    robot = fake("sphero")
    decoder = V1.decoder(Role.HOST)
    for seq, command in enumerate((BOOTLOADER, MAIN, PING)):
        robot.hear(V1.encode_command(command, seq), now=float(seq))
    packets = decoder.feed(b"".join(robot.speak(now=3.0)))
    assert [(packet.seq, packet.code) for packet in packets if isinstance(packet, Response)] == [
        (0, 0),
        (1, 0),
        (2, 0),
    ]
    assert [packet.raw for packet in packets if isinstance(packet, Malformed)] == [b"u>", b"u>"]
    assert robot.next_time() == 592.0


def test_silent_busy_and_late_robots() -> None:
    assert tell(fake("bb8?silent=0:1"), PING) == []
    assert [packet.code for packet in every(Response, tell(fake("bb8?busy=1"), PING))] == [0x0A]
    late = fake("bb8?latency=15ms")
    assert tell(late, PING, now=2.0) == []
    assert len(said_by(late, 2.015)) == 1


def test_damage_is_counted_and_ignored() -> None:
    robot = fake("bb8")
    frame = V1.encode_command(PING, 3)
    robot.hear(frame[:-1] + b"\0" + frame, now=0.0)
    assert [packet.seq for packet in said_by(robot, 0.0)] == [3]
    assert robot.malformed >= 1


@given(st.lists(st.binary(max_size=30), max_size=20), st.sampled_from(list(Strict)))
def test_any_bytes_leave_the_robot_standing(writes: list[bytes], strict: Strict) -> None:
    robot = FakeRobot(Settings(ROBOTS["bb8"], hidden=9, strict=strict))
    for number, data in enumerate(writes):
        robot.hear(data, now=float(number))
        robot.speak(now=float(number))
    due = robot.next_time()
    assert due is None or due > len(writes) - 1, "everything that was due has been said"


@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=24), st.sampled_from(list(Strict)))
def test_any_command_gets_an_answer(did: int, cid: int, payload: bytes, strict: Strict) -> None:
    executed: list[Executed] = []
    robot = FakeRobot(Settings(ROBOTS["sphero"], hidden=50, strict=strict), executed.append)
    response = ask(robot, did, cid, payload)
    exists = any((fact.did, fact.cid) == (did, cid) for fact in robot.truth())
    assert exists == (response.code not in (0x04, 0x09))
    assert bool(executed) == (response.code == 0)
