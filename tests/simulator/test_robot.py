import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS, commands_of, lookup
from sphero_probe.catalogue.model import AnswerStyle, CommandRow, Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Command, Generation, Notification, Response
from sphero_probe.protocol.v2 import FLAG_ACTIVITY, V2, V2Codec
from sphero_probe.simulator import Executed, FakeRobot, Settings, Strict
from sphero_probe.simulator.firmware import Lengths
from tests.support.fake_robot import ask, code_of, fake, said_by, sample_of, tell
from tests.support.narrowing import every, known
from tests.support.tables import rows

V2_ROBOTS = [robot for robot in ROBOTS.values() if robot.generation is Generation.V2]
MODELS = [pytest.param(robot, id=robot.key) for robot in V2_ROBOTS]
READS = [
    pytest.param(robot, row, node, id=f"{robot.key} {row.name} node {node}")
    for robot in V2_ROBOTS
    for row in commands_of(robot)
    if row.kind is Kind.COMMAND and row.risk is Risk.READ
    for node in row.nodes[robot.key]
]
SLEEP, WAKE = Command(0x13, 0x01), Command(0x13, 0x0D)


def _exchange(robot: FakeRobot, data: bytes, now: float = 0.0) -> list[str]:
    """What the robot says to some bytes, as frames in hex."""
    robot.hear(data, now=now)
    return [frame.hex() + "d8" for frame in b"".join(robot.speak(now=now)).split(b"\xd8")[:-1]]


@pytest.mark.parametrize(
    ("model", "sent", "answers"),
    [
        pytest.param(
            "rvr?line=uart", "8d3a0101130d01a2d8", ["8d392101130d010083d8"], id="RVR over UART, real"
        ),
        pytest.param(
            "rvr?line=uart", "8d3a0101130d02a1d8", ["8d392101130d020082d8"], id="RVR over UART, next, real"
        ),
        pytest.param("r2d2", "8d0a130d00d5d8", ["8d09130d0000d6d8"], id="R2-D2, real"),
        pytest.param("r2d2", "8d0a170f0100000000ced8", ["8d09170f0100cfd8"], id="R2-D2 head, real"),
        pytest.param("bolt", "8d3a1101130d0093d8", ["8d2901130d0000b5d8"], id="BOLT, real answer"),
        pytest.param(
            "bolt-plus",
            "8d3a11011a1c003fff0000ff000040d8",
            ["8d3911011a1c00007ed8"],
            id="BOLT+ LEDs, reference",
        ),
        pytest.param("bolt-plus", "8d3a1201110000a1d8", ["8d391101110000099ad8"], id="BOLT+, no node 2"),
        pytest.param("rvr", "8d3e1101130d008fd8", [], id="RVR, only errors, real"),
    ],
)
def test_frames_byte_for_byte(model: str, sent: str, answers: list[str]) -> None:
    assert _exchange(fake(model), bytes.fromhex(sent)) == answers


@pytest.mark.parametrize(
    ("model", "sleep", "wake", "slept", "woken"),
    [
        pytest.param(
            "rvr?line=uart",
            "8d3e11011301009bd8",
            "8d3a0101130d01a2d8",
            ["8d2801131affaad8"],
            ["8d392101130d010083d8", "8d28011311ffb3d8"],
            id="RVR, real",
        ),
        pytest.param(
            "r2d2",
            "8d0a130100e1d8",
            "8d0a130d00d5d8",
            ["8d0913010000e2d8", "8d08131affcbd8"],
            ["8d09130d0000d6d8", "8d081311ffd4d8"],
            id="R2-D2, real wake",
        ),
    ],
)
def test_sleeping_and_waking_byte_for_byte(
    model: str, sleep: str, wake: str, slept: list[str], woken: list[str]
) -> None:
    robot = fake(model)
    assert not robot.asleep
    assert (_exchange(robot, bytes.fromhex(sleep)), robot.asleep) == (slept, True)
    assert _exchange(robot, V2.encode_command(Command(0x10, 0x00), 3)) == []
    assert (_exchange(robot, bytes.fromhex(wake)), robot.asleep) == (woken, False)


@pytest.mark.parametrize("model", MODELS)
def test_deep_sleep_is_for_good(model: Robot) -> None:
    robot = FakeRobot(Settings(model))
    assert code_of(robot, 0x13, 0x00, b"\0") == 0
    assert robot.asleep
    assert tell(robot, WAKE) == []
    assert robot.asleep


@rows(READS)
def test_every_documented_read_answers_and_decodes(model: Robot, row: CommandRow, node: int) -> None:
    robot = FakeRobot(Settings(model, seed=5, matrix=True))
    response = ask(robot, row.did, row.cid, sample_of(row), node=node if model.addressed else None)
    assert response.code == 0
    if row.response is not None:
        decoded = row.response.decode(response.payload)
        assert decoded.problem == ""
        assert decoded.rest == b""


@pytest.mark.unmeasured
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(20))
def test_readings_and_what_follows_decode_with_any_seed(model: Robot, seed: int) -> None:
    robot = FakeRobot(Settings(model, seed=seed))
    for row in commands_of(model):
        if row.kind is not Kind.COMMAND or row.did == 0x13:
            continue
        for node in row.nodes[model.key]:
            target = 0x10 | node if model.addressed else None
            for packet in tell(robot, Command(row.did, row.cid, sample_of(row), target)):
                meant = known(lookup(model.generation, known(packet.did), known(packet.cid), model))
                if meant.response is not None and getattr(packet, "code", 0) == 0:
                    assert meant.response.decode(packet.payload).problem == ""


def _answers_to_reads(robot: FakeRobot) -> list[bytes]:
    rows = [row for row in commands_of(robot.model) if row.kind is Kind.COMMAND and row.risk is Risk.READ]
    return [ask(robot, row.did, row.cid, sample_of(row)).payload for row in rows]


@pytest.mark.parametrize("model", MODELS)
def test_the_seed_makes_the_robot(model: Robot) -> None:
    twins = [FakeRobot(Settings(model, seed=1)) for _ in range(2)]
    other = FakeRobot(Settings(model, seed=2))
    assert _answers_to_reads(twins[0]) == _answers_to_reads(twins[1]) == _answers_to_reads(twins[0])
    assert _answers_to_reads(other) != _answers_to_reads(twins[0])
    assert (twins[0].name, twins[0].address) == (twins[1].name, twins[1].address)
    assert other.name != twins[0].name
    assert other.address != twins[0].address


@pytest.mark.parametrize("model", MODELS)
def test_name_and_address_fit_together(model: Robot) -> None:
    for seed in range(20):
        robot = FakeRobot(Settings(model, seed=seed))
        octets = [int(octet, 16) for octet in robot.address.split(":")]
        assert len(octets) == 6
        assert octets[0] & 0b11 == 0b10, "locally administered, of one station"
        assert robot.name == model.prefix + "".join(f"{octet:02X}" for octet in octets[-2:])
        mac = ask(robot, 0x11, 0x06).payload.partition(b"\0")[0].decode()
        assert mac == robot.address.replace(":", "").lower()
        assert ask(robot, 0x19, 0x04).payload == robot.name.encode() + b"\0"


@pytest.mark.parametrize("seed", range(10))
def test_readings_are_plausible(seed: int) -> None:
    rvr = FakeRobot(Settings(ROBOTS["rvr"], seed=seed))
    assert 20 <= ask(rvr, 0x13, 0x10).payload[0] <= 100
    (volts,) = struct.unpack(">f", ask(rvr, 0x13, 0x25, b"\0").payload)
    assert 3.6 <= volts <= 4.2
    critical, low, hysteresis = struct.unpack(">3f", ask(rvr, 0x13, 0x26).payload)
    assert hysteresis < critical < low < volts
    year, month, day = struct.unpack(">HBB", ask(rvr, 0x11, 0x33).payload)
    assert 2015 < year < 2030
    assert 1 <= month <= 12
    assert 1 <= day <= 28
    major, minor, revision = struct.unpack(">3H", ask(rvr, 0x11, 0x00).payload)
    assert major < 10
    assert minor < 10
    assert 100 <= revision < 1000


@pytest.mark.parametrize("model", MODELS)
def test_what_does_not_exist(model: Robot) -> None:
    robot = FakeRobot(Settings(model))
    for payload in (b"", bytes(11), bytes(40)):
        assert code_of(robot, 0x77, 0x00, payload) == 1
        assert code_of(robot, 0x11, 0xF0, payload) == 2
    assert code_of(robot, 0x10, 0x00, node=3) == 9
    assert (code_of(robot, 0x10, 0x00, node=2) == 9) == (2 not in model.nodes)


@pytest.mark.unmeasured
@pytest.mark.parametrize("model", MODELS)
def test_wrong_lengths(model: Robot) -> None:
    """What a layout cannot take is refused; what it can take is not asked here, it would be run."""
    executed: list[Executed] = []
    robot = FakeRobot(Settings(model), executed.append)
    for fact in robot.truth():
        for length in range(40):
            if not fact.lengths.accepts(length):
                assert code_of(robot, fact.did, fact.cid, bytes(length), node=fact.node) == 5
    assert executed == []


@pytest.mark.parametrize(
    ("strict", "did", "cid", "length", "code"),
    [
        pytest.param("exact", 0x13, 0x10, 11, 5, id="exact: a read with surplus"),
        pytest.param("minimum", 0x13, 0x10, 11, 0, id="minimum: a read with surplus"),
        pytest.param("none", 0x13, 0x10, 11, 0, id="none: a read with surplus"),
        pytest.param("exact", 0x1A, 0x1A, 0, 5, id="exact: LEDs without a mask"),
        pytest.param("minimum", 0x1A, 0x1A, 0, 5, id="minimum: LEDs without a mask"),
        pytest.param("none", 0x1A, 0x1A, 0, 0, id="none: LEDs without a mask"),
        pytest.param("exact", 0x1A, 0x1A, 11, 5, id="exact: LEDs with more values than bits"),
        pytest.param("minimum", 0x1A, 0x1A, 11, 0, id="minimum: LEDs with more values than bits"),
        pytest.param("exact", 0x10, 0x00, 17, 5, id="exact: a long echo"),
        pytest.param("exact", 0x13, 0x01, 11, 5, id="exact: sleep with a probe"),
        pytest.param("minimum", 0x13, 0x01, 11, 0, id="minimum: sleep with a probe"),
        pytest.param("minimum", 0x16, 0x07, 3, 5, id="minimum: driving with too little"),
        pytest.param("none", 0x16, 0x07, 3, 0, id="none: driving with too little"),
        pytest.param("none", 0x77, 0x00, 11, 1, id="none: no such device"),
        pytest.param("none", 0x13, 0xF0, 11, 2, id="none: no such command"),
    ],
)
def test_strictness(strict: str, did: int, cid: int, length: int, code: int) -> None:
    executed: list[Executed] = []
    robot = fake(f"rvr?strict={strict}", executed.append)
    assert code_of(robot, did, cid, bytes(length)) == code
    assert [(run.did, run.cid, run.payload) for run in executed] == (
        [(did, cid, bytes(length))] if code == 0 else []
    )


def test_an_led_command_with_too_few_values_is_refused_if_lengths_are_checked() -> None:
    payload = b"\x07\xff"
    assert {
        strict: code_of(FakeRobot(Settings(ROBOTS["bolt"], strict=strict)), 0x1A, 0x1C, payload)
        for strict in Strict
    } == {
        Strict.EXACT: 5,
        Strict.MINIMUM: 5,
        Strict.NONE: 0,
    }


def test_an_echo_that_is_too_long_is_cut_where_surplus_is_ignored() -> None:
    assert ask(fake("bolt?strict=minimum"), 0x10, 0x00, bytes(range(20))).payload == bytes(range(16))


def test_length_may_mask_existence() -> None:
    robot = fake("bolt?mask=1")
    assert code_of(robot, 0x13, 0xF0, bytes(11)) == 5
    assert code_of(robot, 0x13, 0xF0) == 2
    assert code_of(robot, 0x77, 0xF0, bytes(11)) == 1


def test_hidden_commands_answer_like_any_other() -> None:
    executed: list[Executed] = []
    robot = fake("r2d2?hidden=30&seed=4", executed.append)
    twin = fake("r2d2?hidden=30&seed=4")
    hidden = [fact for fact in robot.truth() if fact.hidden]
    for fact in hidden:
        if not fact.lengths.accepts(11):
            assert code_of(robot, fact.did, fact.cid, bytes(11)) == 5
    assert executed == []
    for fact in hidden:
        right = bytes(fact.lengths.minimum)
        assert ask(robot, fact.did, fact.cid, right) == ask(twin, fact.did, fact.cid, right)
        assert executed[-1] == Executed(fact.node, fact.did, fact.cid, right, fact.risk)
    assert len(executed) == len(hidden)


@pytest.mark.parametrize(
    ("did", "cid", "payload", "code"),
    [
        pytest.param(0x16, 0x01, bytes([9, 0, 0, 0]), 7, id="no such motor mode"),
        pytest.param(0x18, 0x42, bytes([2]), 7, id="no such motor"),
        pytest.param(0x1A, 0x1A, b"\x80\x00\x00\x00\x01", 7, id="no such LED"),
        pytest.param(0x1D, 0x1C, b"\0", 7, id="no such reset strategy"),
        pytest.param(0x1F, 0x14, bytes(4), 4, id="factory mode"),
        pytest.param(0x16, 0x07, b"\0\0\0\x40", 0, id="a flag nobody knows"),
    ],
)
def test_values_and_states_that_are_refused(did: int, cid: int, payload: bytes, code: int) -> None:
    executed: list[Executed] = []
    robot = fake("rvr", executed.append)
    assert code_of(robot, did, cid, payload) == code
    assert bool(executed) == (code == 0)


def test_a_stub() -> None:
    executed: list[Executed] = []
    assert code_of(fake("mini", executed.append), 0x12, 0x29, b"\x01") == 3
    assert executed == []


def test_codes_on_request() -> None:
    robot = fake("rvr")
    assert [code_of(robot, 0x10, 0x09, bytes([code]), node=1) for code in range(256)] == list(range(256))


ANSWERED_OK, ANSWERED_BAD = Command(0x13, 0x10), Command(0x13, 0xF0)


@pytest.mark.parametrize(
    ("command", "flags", "codes", "executed"),
    [
        pytest.param(ANSWERED_OK, {}, [0], 1, id="asked"),
        pytest.param(ANSWERED_OK, {"answer": False}, [], 1, id="not asked"),
        pytest.param(ANSWERED_BAD, {"answer": False}, [], 0, id="not asked, error"),
        pytest.param(ANSWERED_OK, {"only_errors": True}, [], 1, id="only errors, none"),
        pytest.param(ANSWERED_BAD, {"only_errors": True}, [2], 0, id="only errors, one"),
        pytest.param(ANSWERED_OK, {"answer": False, "only_errors": True}, [6], 0, id="only errors, alone"),
        pytest.param(ANSWERED_OK, {"extension": b"\x00"}, [0], 1, id="a second flags byte"),
    ],
)
def test_who_gets_an_answer(command: Command, flags: dict[str, Any], codes: list[int], executed: int) -> None:
    ledger: list[Executed] = []
    robot = fake("rvr", ledger.append)
    assert [packet.code for packet in every(Response, tell(robot, command, **flags))] == codes
    assert len(ledger) == executed


@pytest.mark.parametrize(
    ("model", "target", "source", "response"),
    [
        pytest.param("rvr?line=uart", 0x01, 0x01, (0x21, 1), id="RVR, UART"),
        pytest.param("rvr?line=uart", 0x02, 0x01, (0x21, 2), id="RVR, UART, node 2"),
        pytest.param("rvr?line=uart", 0x12, 0x01, (0x21, 2), id="RVR, UART, whatever port the client writes"),
        pytest.param("rvr?line=uart", None, 0x01, (0x21, 1), id="RVR, UART, only a source"),
        pytest.param("rvr", 0x11, 0x01, (0x11, 1), id="RVR, BLE"),
        pytest.param("rvr", 0x12, 0x03, (0x13, 2), id="RVR, BLE, node 2, another client"),
        pytest.param("rvr", None, None, (None, None), id="RVR, no addresses"),
        pytest.param("rvr", 0x01, 0x01, (0x11, 1), id="RVR, BLE, whatever port the client writes"),
        pytest.param("rvr", None, 0x01, (0x11, 1), id="RVR, BLE, only a source"),
        pytest.param("bolt-plus", 0x11, 0x01, (0x11, 1), id="BOLT+"),
        pytest.param("bolt-plus", 0x12, 0x01, (0x11, 1), id="BOLT+, no such node: node 1 says so"),
        pytest.param("bolt", 0x12, 0x01, (None, 2), id="BOLT"),
        pytest.param("bolt", None, None, (None, 1), id="BOLT, no addresses"),
        pytest.param("r2d2", 0x11, 0x01, (None, None), id="R2-D2"),
    ],
)
def test_addresses_of_responses(
    model: str, target: int | None, source: int | None, response: tuple[int | None, int | None]
) -> None:
    robot = fake(model)
    robot.hear(V2Codec().encode_command(Command(0x10, 0x00, b"", target), 7, source=source), now=0.0)
    assert [(packet.target, packet.source) for packet in said_by(robot, 0.0)] == [response]


def test_a_target_without_a_source_is_answered_without_a_target() -> None:
    """The maker's SDK sends TID alone; an answer with SID alone was seen on an RVR."""
    bare = bytes.fromhex("1a11100001")
    robot = fake("rvr")
    robot.hear(b"\x8d" + bare + bytes([~sum(bare) & 0xFF]) + b"\xd8", now=0.0)
    (response,) = said_by(robot, 0.0)
    assert (response.target, response.source) == (None, 1)


def test_the_sleep_timer_flag_comes_back() -> None:
    robot = fake("rvr")
    assert [packet.flags & FLAG_ACTIVITY for packet in tell(robot, Command(0x10, 0x00), activity=False)] == [
        0
    ]
    assert [packet.flags & FLAG_ACTIVITY for packet in tell(robot, Command(0x10, 0x00))] == [FLAG_ACTIVITY]


def test_the_wildcard_is_served_by_a_node_that_can() -> None:
    robot = fake("rvr")
    assert code_of(robot, 0x16, 0x06, node=1) == 1
    assert code_of(robot, 0x18, 0x13, node=1) == 2
    assert code_of(robot, 0x16, 0x06, node=0) == 0
    assert [packet.source for packet in tell(robot, Command(0x16, 0x06, b"", 0x10))] == [2]
    assert [packet.source for packet in tell(robot, Command(0x77, 0x06, b"", 0x10))] == [1]


def test_without_a_target_the_node_that_receives_it_answers() -> None:
    robot = fake("rvr")
    codes = [every(Response, tell(robot, Command(*pair)))[0].code for pair in ((0x13, 0x10), (0x16, 0x06))]
    assert codes == [0, 1]


def test_nodes_answer_differently() -> None:
    robot = fake("rvr?seed=6")
    assert ask(robot, 0x11, 0x00, node=1).payload != ask(robot, 0x11, 0x00, node=2).payload
    assert [ask(robot, 0x11, 0x1F, node=node).payload for node in (1, 2)] == [b"primary\0", b"secondary\0"]


@pytest.mark.parametrize("model", MODELS)
def test_notifications(model: Robot) -> None:
    robot = FakeRobot(Settings(model))
    (*_, slept) = tell(robot, SLEEP)
    style = model.answer_style is not AnswerStyle.NONE
    assert slept == Notification(0x13, 0x1A, b"", 1 if style else None, None, 0xFF, 0x28 if style else 0x08)


@pytest.mark.parametrize(
    ("model", "asked", "told", "payload"),
    [
        pytest.param("bolt", (0x11, 0x17), (0x11, 0x18), b"", id="second version"),
        pytest.param("r2d2", (0x11, 0x24), (0x11, 0x25), b"", id="second bootloader"),
        pytest.param("rvr", (0x11, 0x3F), (0x11, 0x3E), b"\1", id="SOS message, in the response too"),
        pytest.param("rvr", (0x18, 0x37), (0x18, 0x36), b"", id="colour"),
        pytest.param("rvr", (0x18, 0x25), (0x18, 0x26), b"", id="north"),
    ],
)
def test_some_answers_come_as_notifications(
    model: str, asked: tuple[int, int], told: tuple[int, int], payload: bytes
) -> None:
    robot = fake(model)
    anyone = 0x10 if robot.model.addressed else None
    response, notification = tell(robot, Command(*asked, target=anyone))
    assert isinstance(response, Response)
    assert (response.code, response.payload) == (0, payload)
    assert (notification.did, notification.cid) == told
    decoded = known(known(lookup(robot.model.generation, *told, robot.model)).response).decode(
        notification.payload
    )
    assert decoded.fields
    assert decoded.problem == ""


def test_a_notification_that_must_be_switched_on() -> None:
    robot = fake("r2d2")
    action, switch = Command(0x17, 0x0D, b"\x01"), (0x17, 0x2A)
    assert len(tell(robot, action)) == 1
    ask(robot, *switch, b"\x01")
    assert [(packet.did, packet.cid) for packet in tell(robot, action)] == [(0x17, 0x0D), (0x17, 0x26)]
    ask(robot, *switch, b"\x00")
    assert len(tell(robot, action)) == 1


@pytest.mark.parametrize(
    ("model", "node", "setter", "getter", "payload"),
    [
        pytest.param("r2d2", 1, (0x1A, 0x08), (0x1A, 0x09), b"\x64", id="volume"),
        pytest.param("r2d2", 1, (0x17, 0x0F), (0x17, 0x14), struct.pack(">f", 20.5), id="head"),
        pytest.param("bb9e", 1, (0x17, 0x2D), (0x17, 0x2E), b"\x01", id="trophy mode"),
        pytest.param("bolt", 2, (0x18, 0x00), (0x18, 0x01), bytes.fromhex("00 96 00 00070000"), id="stream"),
        pytest.param("mini", 1, (0x18, 0x0C), (0x18, 0x0D), bytes.fromhex("03800000"), id="extended mask"),
        pytest.param("rvr", 1, (0x19, 0x03), (0x19, 0x04), b"RV-ABCD\0", id="name"),
        pytest.param("rvr", 1, (0x12, 0x2C), (0x12, 0x2B), b"\x01", id="out of box"),
        pytest.param("rvr", 2, (0x16, 0x3C), (0x16, 0x3D), struct.pack(">4fB", 1, 2, 3, 4, 1), id="slew"),
        pytest.param("rvr", 1, (0x1A, 0x45), (0x1A, 0x44), bytes(range(48)), id="palette"),
        pytest.param("bolt", 1, (0x11, 0x2D), (0x11, 0x2C), bytes(range(8)) + b"data", id="config block"),
    ],
)
def test_what_is_set_is_told(
    model: str, node: int, setter: tuple[int, int], getter: tuple[int, int], payload: bytes
) -> None:
    robot = fake(model)
    other = payload[:-1] + bytes([payload[-1] ^ 1])
    for value in (payload, other, payload):
        assert code_of(robot, *setter, value, node=node) == 0
        assert ask(robot, *getter, node=node).payload == value


def test_a_refused_setting_changes_nothing() -> None:
    robot = fake("r2d2")
    before = ask(robot, 0x1A, 0x09).payload
    assert code_of(robot, 0x1A, 0x08, b"\x01\x02") == 5
    assert ask(robot, 0x1A, 0x09).payload == before


def test_the_name_is_the_bluetooth_name() -> None:
    robot = fake("bolt")
    ask(robot, 0x1A, 0x1C, b"\0")
    assert robot.name.startswith("SB-")
    ask(robot, 0x19, 0x03, b"SB-\xff\0")
    assert robot.name == "SB-\N{REPLACEMENT CHARACTER}"


@pytest.mark.parametrize(
    ("model", "cid", "payload", "expected"),
    [
        pytest.param(
            "bolt-plus", 0x1C, "07ff0102", {"front_red": 255, "front_green": 1, "front_blue": 2}, id="front"
        ),
        pytest.param("bolt", 0x1C, "2105 06", {"front_red": 5, "back_blue": 6}, id="two channels"),
        pytest.param("bolt", 0x1C, "00", {}, id="none"),
        pytest.param("bb9e", 0x0E, "0018 0910", {"aiming": 9, "head": 16}, id="single LEDs"),
        pytest.param(
            "rvr", 0x1A, "40000001 0708", {"right_headlight_red": 7, "undercarriage": 8}, id="32 bits"
        ),
    ],
)
def test_leds(model: str, cid: int, payload: str, expected: dict[str, int]) -> None:
    robot = fake(model)
    assert set(robot.leds.values()) == {0}
    assert code_of(robot, 0x1A, cid, bytes.fromhex(payload)) == 0
    assert {name: value for name, value in robot.leds.items() if value} == expected


def test_a_robot_without_known_leds() -> None:
    assert fake("lmq").leds == {}


def test_frames_are_saved_and_deleted() -> None:
    robot = fake("bolt")
    assert ask(robot, 0x1A, 0x34, node=2).payload == b""
    for number in (5, 3, 5):
        assert code_of(robot, 0x1A, 0x30, struct.pack(">H", number) + bytes(8), node=2) == 0
    assert ask(robot, 0x1A, 0x34, node=2).payload == struct.pack(">2H", 3, 5)
    assert code_of(robot, 0x1A, 0x35, node=2) == 0
    assert ask(robot, 0x1A, 0x34, node=2).payload == b""


@pytest.mark.parametrize("model", ["bolt", "rvr"])
def test_what_a_robot_says_about_itself_is_its_table(model: str) -> None:
    robot = fake(f"{model}?hidden=20")
    told = {
        (node, did, cid)
        for node in robot.model.nodes
        for did in ask(robot, 0x10, 0x05, node=node).payload
        for cid in ask(robot, 0x10, 0x06, bytes([did]), node=node).payload
    }
    assert told == {(fact.node, fact.did, fact.cid) for fact in robot.truth() if not fact.hidden}


def test_a_robot_that_says_nothing_about_itself() -> None:
    robot = fake("bolt?claims=none")
    assert [code_of(robot, 0x10, 0x05), code_of(robot, 0x10, 0x06, b"\x10")] == [2, 2]
    assert not [fact for fact in robot.truth() if fact.did == 0x10 and fact.cid in (5, 6)]


def _stream(robot: FakeRobot, interval: int, count: int, mask: int, now: float = 0.0) -> None:
    assert code_of(robot, 0x18, 0x00, struct.pack(">HBI", interval, count, mask), now=now) == 0


def test_streaming_follows_the_clock_of_the_caller() -> None:
    robot = fake("bolt")
    assert robot.next_time() is None
    _stream(robot, 250, 0, 0x0007_0000, now=100.0)
    assert robot.next_time() == 100.25
    assert said_by(robot, 100.2) == []
    packets = said_by(robot, 101.0)
    assert [(packet.did, packet.cid, packet.source) for packet in packets] == [(0x18, 0x02, 2)] * 4
    assert all(len(packet.payload) == 12 for packet in packets)
    assert len({packet.payload for packet in packets}) == 4
    assert robot.next_time() == 101.25
    _stream(robot, 0, 0, 0, now=101.1)
    assert robot.next_time() is None


def test_a_stream_ends_after_its_count() -> None:
    robot = fake("mini")
    _stream(robot, 100, 3, 0x2)
    times = [struct.unpack(">f", packet.payload)[0] for packet in said_by(robot, 9.0)]
    assert times == [100.0, 200.0, 300.0]
    assert robot.next_time() is None


def test_a_stream_carries_the_extended_sensors_behind_the_others() -> None:
    robot = fake("r2d2")
    ask(robot, 0x18, 0x0C, bytes.fromhex("04000000"))
    _stream(robot, 100, 1, 0x0000_2000)
    ((upwards, head),) = [struct.unpack(">2f", packet.payload) for packet in said_by(robot, 1.0)]
    assert math.isclose(upwards, 1.0, abs_tol=0.1)
    assert abs(head) <= 1.0


def test_a_stream_of_nothing_is_silent() -> None:
    robot = fake("bolt")
    _stream(robot, 100, 0, 0)
    assert robot.next_time() is None


def test_sleep_ends_a_stream() -> None:
    robot = fake("bolt")
    _stream(robot, 100, 0, 0x0007_0000)
    tell(robot, SLEEP)
    assert said_by(robot, 60.0) == []
    assert robot.next_time() is None


def test_a_stream_that_nobody_listened_to_is_not_caught_up_for_ever() -> None:
    robot = fake("bolt")
    _stream(robot, 10, 0, 0x0007_0000)
    assert 1 < len(said_by(robot, 1e6)) < 100


def test_silent_pairs_are_executed_and_never_answered() -> None:
    executed: list[Executed] = []
    robot = fake("bolt-plus?silent=0x13:0x10,0x77:0x00", executed.append)
    assert tell(robot, Command(0x13, 0x10)) == []
    assert tell(robot, Command(0x77, 0x00)) == []
    assert len(executed) == 1
    assert code_of(robot, 0x13, 0x17) == 0


def test_a_busy_robot_executes_nothing() -> None:
    executed: list[Executed] = []
    robot = fake("bolt?busy=1", executed.append)
    assert code_of(robot, 0x13, 0x03) == 8
    assert executed == []
    codes = [code_of(robot, 0x13, 0x03) for robot in [fake("bolt?busy=0.5&seed=2")] for _ in range(40)]
    assert codes == [
        code_of(robot, 0x13, 0x03) for robot in [fake("bolt?busy=0.5&seed=2")] for _ in range(40)
    ]
    assert set(codes) == {0, 8}


def test_latency_delays_the_answer_not_the_execution() -> None:
    executed: list[Executed] = []
    robot = fake("bolt?latency=15ms", executed.append)
    assert tell(robot, Command(0x13, 0x03), now=2.0) == []
    assert len(executed) == 1
    assert robot.next_time() == 2.015
    assert len(said_by(robot, 2.015)) == 1
    assert robot.next_time() is None


def test_one_byte_per_notification() -> None:
    robot = fake("bolt?split=1")
    robot.hear(V2.encode_command(WAKE, 0), now=0.0)
    assert [chunk.hex() for chunk in robot.speak(now=0.0)] == [
        "8d",
        "29",
        "01",
        "13",
        "0d",
        "00",
        "00",
        "b5",
        "d8",
    ]


def test_commands_may_arrive_in_pieces() -> None:
    robot = fake("bolt")
    for byte in V2.encode_command(WAKE, 0):
        assert robot.speak(now=0.0) == []
        robot.hear(bytes([byte]), now=0.0)
    assert b"".join(robot.speak(now=0.0)).hex() == "8d2901130d0000b5d8"


def _run(text: str) -> tuple[list[bytes], list[Executed], int]:
    """A conversation over a bad line: everything heard, and everything run."""
    executed: list[Executed] = []
    robot = fake(text, executed.append)
    said = []
    for number in range(120):
        robot.hear(V2.encode_command(Command(0x13, 0x03), number), now=number / 10)
        said += robot.speak(now=number / 10)
    return said, executed, robot.malformed


def test_a_bad_line_is_bad_in_the_same_way_every_time() -> None:
    line = "loss=0.1&corrupt=0.1&duplicate=0.1&split=3"
    said, executed, malformed = _run(f"bolt?seed=1&{line}")
    assert (said, executed, malformed) == _run(f"bolt?seed=1&{line}")
    assert said != _run(f"bolt?seed=2&{line}")[0]
    assert len(executed) < 120
    assert malformed > 0


def test_damage_is_counted_and_ignored() -> None:
    robot = fake("bolt")
    frame = V2.encode_command(WAKE, 0)
    assert _exchange(robot, frame[:-2] + b"\x00\xd8" + b"noise\xd8") == []
    assert robot.malformed == 2
    assert len(_exchange(robot, frame)) == 1
    assert _exchange(robot, V2.encode_response(Response(0, 0, b"", 0x13, 0x0D))) == []
    assert robot.malformed == 2


@given(st.lists(st.binary(max_size=30), max_size=20), st.sampled_from(list(Strict)))
def test_any_bytes_leave_the_robot_standing(writes: list[bytes], strict: Strict) -> None:
    robot = FakeRobot(Settings(ROBOTS["rvr"], hidden=9, strict=strict))
    for number, data in enumerate(writes):
        robot.hear(data, now=float(number))
        robot.speak(now=float(number))
    assert robot.next_time() is None


@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=24), st.sampled_from(list(Strict)))
def test_any_command_gets_an_answer(did: int, cid: int, payload: bytes, strict: Strict) -> None:
    executed: list[Executed] = []
    robot = FakeRobot(Settings(ROBOTS["rvr"], hidden=50, strict=strict), executed.append)
    response = ask(robot, did, cid, payload)
    exists = any((fact.did, fact.cid) == (did, cid) for fact in robot.truth())
    assert exists or response.code in (1, 2)
    assert len(executed) <= 1
    if (did, cid) != (0x10, 0x09):
        assert bool(executed) == (response.code == 0)


def test_the_ledger_as_json() -> None:
    executed: list[Executed] = []
    robot = fake("rvr", executed.append)
    ask(robot, 0x16, 0x07, bytes.fromhex("00AB0001"))
    assert [run.as_json() for run in executed] == [
        {"node": 2, "did": 22, "cid": 7, "payload": "00ab0001", "risk": "motion"}
    ]


def test_the_truth_tells_what_the_robot_accepts() -> None:
    robot = fake("rvr?hidden=10")
    assert [fact.lengths for fact in robot.truth() if (fact.did, fact.cid) == (0x10, 0x00)] == [
        Lengths(0, 16)
    ] * 2
    assert sum(fact.hidden for fact in robot.truth()) == 10
