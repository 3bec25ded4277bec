"""The streaming services of the fake RVR, driven by what the maker's SDK sends."""

from collections.abc import Iterable
from typing import Final

import pytest

from sphero_probe.catalogue.streaming_services import (
    SERVICES,
    Configurations,
    configured_after,
    delivered_fields,
)
from sphero_probe.protocol.packets import Command, Notification, Packet, Request, Response, Role, Verdict
from sphero_probe.protocol.v2 import V2
from sphero_probe.simulator import FakeRobot, parse_settings

SDK_START: Final = [
    bytes.fromhex(frame)
    for frame in (
        "8d1801130d01c5d8",
        "8d1801183902010003008fd8",
        "8d180118390302000a0284d8",
        "8d18011839040300090283d8",
        "8d1802183905010000020001020002020004027fd8",
        "8d180218390602000602000702000802000b0264d8",
        "8d1802183907030009027fd8",
        "8d1801183a0800fa92d8",
        "8d1802183a0900fa90d8",
    )
]
"""Wake, then all eleven services at 250 ms.

Written by sphero_sdk of sphero-inc/sphero-sdk-raspberrypi-python at 5dbeda9 (rvr.wake, sensor_control.start)
into a recording data access layer.
"""
SDK_STOP: Final = [bytes.fromhex("8d1801183c0a88d8"), bytes.fromhex("8d1802183c0b86d8")]
"""The same of sensor_control.stop."""
PERIOD: Final = 0.25


def tell(robot: FakeRobot, frames: Iterable[bytes], *, now: float = 0.0) -> list[Packet]:
    for frame in frames:
        robot.hear(frame, now=now)
    return V2.decoder(Role.HOST).feed(b"".join(robot.speak(now=now)))


def listen(robot: FakeRobot, until: float) -> list[Notification]:
    packets = V2.decoder(Role.HOST).feed(b"".join(robot.speak(now=until)))
    assert all(isinstance(packet, Notification) for packet in packets)
    return [packet for packet in packets if isinstance(packet, Notification)]


def configured_by(frames: Iterable[bytes]) -> Configurations:
    configured: Configurations = {}
    for packet in V2.decoder(Role.ROBOT).feed(b"".join(frames)):
        assert isinstance(packet, Request)
        configured = configured_after(configured, packet.command)
    return configured


@pytest.mark.parametrize("model", ["rvr", "rvr-plus"])
@pytest.mark.parametrize("seed", range(5))
def test_the_makers_sdk_gets_the_state_of_the_robot(model: str, seed: int) -> None:
    robot = FakeRobot(parse_settings(f"{model}?seed={seed}"))
    assert tell(robot, SDK_START) == []  # it asks for no answers
    delivered = listen(robot, 1.1)
    assert {(packet.did, packet.cid) for packet in delivered} == {(0x18, 0x3D)}
    configured = configured_by(SDK_START)
    times = 4
    assert len(delivered) == times * len(configured) == times * 6
    for number, packet in enumerate(delivered):
        decoded = delivered_fields(configured, packet.payload, packet.source)
        assert decoded is not None
        slots = configured[(packet.source or 0) & 0x0F, packet.payload[0]]
        for service, bits in slots:
            for channel in service.channels:
                value = decoded.fields[channel.name]
                if service.name == "core_time":
                    continue
                step = (channel.maximum - channel.minimum) / ((1 << bits) - 1)
                assert value == pytest.approx(robot.sensors[channel.name], abs=step + 1e-6), channel.name
        if any(service.name == "core_time" for service, _ in slots):
            milliseconds = 1000 * PERIOD * (number // len(configured) + 1)
            assert (decoded.fields["core_time_upper"], decoded.fields["core_time_lower"]) == (0, milliseconds)
    tokens = {((packet.source or 0) & 0x0F, packet.payload[0]) for packet in delivered}
    assert tokens == configured.keys()
    assert tell(robot, SDK_STOP, now=1.1) == []
    assert listen(robot, 9.0) == []


def test_the_state_of_a_robot_names_every_sensor_but_the_clock_and_differs_by_seed() -> None:
    names = {channel.name for service in SERVICES.values() for channel in service.channels}
    first, second = (FakeRobot(parse_settings(f"rvr?seed={seed}")).sensors for seed in (1, 2))
    assert first.keys() == names - {"core_time_upper", "core_time_lower"}
    assert first != second
    for service in SERVICES.values():
        for channel in service.channels:
            assert channel.minimum <= first.get(channel.name, 0) <= channel.maximum


def ask(robot: FakeRobot, cid: int, payload: str, node: int, *, now: float = 0.0) -> Verdict:
    frame = V2.encode_command(Command(0x18, cid, bytes.fromhex(payload), node), 1)
    response = next(packet for packet in tell(robot, [frame], now=now) if isinstance(packet, Response))
    return V2.verdict(response.code)


@pytest.mark.parametrize(
    ("payload", "node", "verdict"),
    [
        pytest.param("01 0001 02", 2, Verdict.OK, id="IMU"),
        pytest.param("01 0001 01", 2, Verdict.OK, id="IMU in 16 bits"),
        pytest.param("03 000a 01", 1, Verdict.FAILED, id="real: RVR 8.3.432, nodejs#6"),
        pytest.param("01 0001 02", 1, Verdict.FAILED, id="a service of the other node"),
        pytest.param("01 0005 02", 2, Verdict.FAILED, id="no such service"),
        pytest.param("01 0001 07", 2, Verdict.FAILED, id="no such size"),
        pytest.param("00 0001 02", 2, Verdict.FAILED, id="no such token"),
        pytest.param("01 00", 2, Verdict.FAILED, id="cut off"),
        pytest.param("", 2, Verdict.BAD_LENGTH, id="nothing"),
    ],
)
def test_a_bad_configuration_is_refused_and_leaves_all_as_it_was(
    payload: str, node: int, verdict: Verdict
) -> None:
    robot = FakeRobot(parse_settings("rvr"))
    assert ask(robot, 0x39, "02 0008 02", 2) is Verdict.OK
    assert ask(robot, 0x39, payload, node) is verdict
    assert ask(robot, 0x3A, "0064", 2) is Verdict.OK
    tokens = {packet.payload[0] for packet in listen(robot, 0.15)}
    assert tokens == ({1, 2} if verdict is Verdict.OK else {2})


def test_stop_pauses_and_clear_forgets() -> None:
    robot = FakeRobot(parse_settings("rvr"))
    assert ask(robot, 0x39, "01 0008 00", 2) is Verdict.OK
    assert listen(robot, 1.0) == []
    assert ask(robot, 0x3A, "0064", 2, now=1.0) is Verdict.OK
    assert [len(packet.payload) for packet in listen(robot, 1.25)] == [2, 2]
    assert ask(robot, 0x3B, "", 2, now=1.25) is Verdict.OK
    assert listen(robot, 2.0) == []
    assert ask(robot, 0x3A, "0064", 2, now=2.0) is Verdict.OK
    assert len(listen(robot, 2.15)) == 1
    assert ask(robot, 0x3C, "", 2, now=2.15) is Verdict.OK
    assert ask(robot, 0x3A, "0064", 2, now=2.15) is Verdict.OK
    assert listen(robot, 3.0) == []


def test_nodes_stream_apart_and_sleep_ends_both() -> None:
    robot = FakeRobot(parse_settings("rvr"))
    assert ask(robot, 0x39, "01 0008 00", 2) is Verdict.OK
    assert ask(robot, 0x39, "01 0003 00", 1) is Verdict.OK
    assert ask(robot, 0x3A, "0064", 2) is Verdict.OK
    assert ask(robot, 0x3A, "0032", 1) is Verdict.OK
    sources = [(packet.source, len(packet.payload)) for packet in listen(robot, 0.11)]
    assert sorted(sources) == [(1, 6), (1, 6), (2, 2)]
    robot.hear(V2.encode_command(Command(0x13, 0x01, b"", 1), 2), now=0.11)
    robot.speak(now=0.11)
    assert listen(robot, 5.0) == []


def test_temperatures_are_those_of_the_ids_that_were_asked_for() -> None:
    """A real RVR echoes the ids and has plausible numbers for all of them [Atriz, evidence 43]."""
    robot = FakeRobot(parse_settings("rvr"))
    answers = {}
    for ids in ("0405", "0504", "04c8"):
        frame = V2.encode_command(Command(0x18, 0x4A, bytes.fromhex(ids), 2), 1)
        (response,) = tell(robot, [frame])
        assert isinstance(response, Response)
        assert (response.code, len(response.payload)) == (0, 10)
        assert (response.payload[0], response.payload[5]) == tuple(bytes.fromhex(ids))
        answers[ids] = response.payload
    assert answers["0405"][:5] == answers["0504"][5:] == answers["04c8"][:5]
    assert answers["0405"][5:] == answers["0504"][:5]


def test_disabling_all_notifications_is_a_command_of_the_first_node() -> None:
    """target=1 in the maker's SDK."""
    robot = FakeRobot(parse_settings("rvr"))
    assert ask(robot, 0x54, "", 1) is Verdict.OK
    assert ask(robot, 0x54, "", 2) is Verdict.NO_COMMAND


def test_bolt_plus_has_a_matrix_only_where_it_is_told_to() -> None:
    """The description of BOLT+: front and back LEDs by 1A/1C, no 8x8 matrix, error 0x09 from node 2."""
    set_leds = V2.encode_command(Command(0x1A, 0x1C, bytes.fromhex("3fff0000ff0000"), 0x11), 1)
    for settings, verdict in (("bolt-plus", Verdict.NO_COMMAND), ("bolt-plus?matrix=1", Verdict.OK)):
        robot = FakeRobot(parse_settings(settings))
        (lit,) = tell(robot, [set_leds])
        assert isinstance(lit, Response)
        assert lit.code == 0
        assert robot.leds["front_red"] == robot.leds["back_red"] == 0xFF
        matrix = V2.encode_command(Command(0x1A, 0x2F, b"\xff\0\0", 0x11), 2)
        elsewhere = V2.encode_command(Command(0x1A, 0x2F, b"\xff\0\0", 0x12), 3)
        here, there = tell(robot, [matrix, elsewhere])
        assert isinstance(here, Response)
        assert isinstance(there, Response)
        assert V2.verdict(here.code) is verdict
        assert there.code == 0x09
    assert FakeRobot(parse_settings("bolt?matrix=0")).truth() == FakeRobot(parse_settings("bolt")).truth()
