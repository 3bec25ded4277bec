"""The maker's Python SDK on a UART: what it writes, recorded, and what it needs to hear.

Written by the observer of sphero_sdk (sphero-inc/sphero-sdk-raspberrypi-python at 5dbeda9, with pyserial) to
the pseudo-terminal of ``sphero-probe serve fake:rvr``: wake, then on both nodes echo, version and name, the
battery, all LEDs in two colours, and the sensors ambient light and IMU each 100 ms. It writes a target but no
source, and finds the handler of a packet by device id, command id, sequence number and source. So it would
lose a response that does not name its node.
"""

from typing import Final

import pytest

from sphero_probe.protocol.packets import Notification, Packet, Response, Role
from sphero_probe.protocol.v2 import V2
from sphero_probe.simulator import FakeRobot, parse_settings
from tests.support.narrowing import every, only

WAKE: Final = "8d1801130d01c5d8"
ASKED: Final = {
    "8d1a0110000201020301cbd8": "8d29011000020001020301bcd8",
    "8d1a0210000501020302c6d8": "8d29021000050001020302b7d8",
    "8d1a01111f04b0d8": "8d2901111f04007072696d617279009dd8",
    "8d1a02111f07acd8": "8d2902111f07007365636f6e6461727900d5d8",
}
"""Echo and name of each node, and the answers that reached the SDK's handlers."""
VERSIONS: Final = ("8d1a01110003d0d8", "8d1a02110006ccd8")
BATTERY: Final = "8d1a01131008b9d8"
RED: Final = "8d18011a1a093fffffff" + "ff0040" * 10 + "f7d8"
GREEN: Final = "8d18011a1a0a3fffffff" + "00ff00" * 10 + "76d8"
SERVICES: Final = ("8d180118390b02000a027cd8", "8d180218390c0100010284d8")
START: Final = ("8d1801183a0d006423d8", "8d1802183a0e006421d8")
CLEAR: Final = ("8d1801183c0f83d8", "8d1802183c1081d8")


@pytest.fixture
def robot() -> FakeRobot:
    woken = FakeRobot(parse_settings("rvr?line=uart"))
    assert _said(woken, WAKE) == []
    return woken


def _said(robot: FakeRobot, *frames: str, now: float = 0.0) -> list[Packet]:
    for frame in frames:
        robot.hear(bytes.fromhex(frame), now=now)
    return V2.decoder(Role.HOST).feed(b"".join(robot.speak(now=now)))


@pytest.mark.parametrize(("frame", "answer"), ASKED.items())
def test_both_nodes_answer_byte_for_byte(robot: FakeRobot, frame: str, answer: str) -> None:
    robot.hear(bytes.fromhex(frame), now=0.0)
    assert robot.speak(now=0.0) == [bytes.fromhex(answer)]


def test_each_node_has_a_version_of_its_own(robot: FakeRobot) -> None:
    first, second = every(Response, _said(robot, *VERSIONS))
    assert [(one.seq, one.source, one.target, one.code) for one in (first, second)] == [
        (3, 1, None, 0),
        (6, 2, None, 0),
    ]
    assert len(first.payload) == len(second.payload) == 6
    assert first.payload != second.payload


def test_the_battery_is_read(robot: FakeRobot) -> None:
    answer = only(Response, _said(robot, BATTERY))
    assert (answer.seq, answer.source, len(answer.payload)) == (8, 1, 1)
    assert answer.payload[0] <= 100


def test_all_leds_are_set(robot: FakeRobot) -> None:
    assert _said(robot, RED) == []
    lamps = {lamp.rpartition("_")[0] for lamp in robot.leds if lamp != "undercarriage"}
    assert {lamp: _colour(robot, lamp) for lamp in lamps} == dict.fromkeys(lamps, (0xFF, 0x00, 0x40))
    assert len(lamps) == 10
    assert _said(robot, GREEN) == []
    assert {_colour(robot, lamp) for lamp in lamps} == {(0x00, 0xFF, 0x00)}


def _colour(robot: FakeRobot, lamp: str) -> tuple[int, ...]:
    return tuple(robot.leds[f"{lamp}_{colour}"] for colour in ("red", "green", "blue"))


def test_samples_of_both_nodes_are_streamed_until_they_are_cleared(robot: FakeRobot) -> None:
    assert _said(robot, *SERVICES, *START) == []
    samples = every(Notification, _said(robot, now=1.05))
    assert {(one.did, one.cid, one.source, one.seq) for one in samples} == {
        (0x18, 0x3D, 1, 0xFF),
        (0x18, 0x3D, 2, 0xFF),
    }
    by_node = {node: [one.payload for one in samples if one.source == node] for node in (1, 2)}
    assert [len(payloads) for payloads in by_node.values()] == [10, 10]
    light, imu = by_node[1][0], by_node[2][0]
    assert (light[0], len(light), imu[0], len(imu)) == (2, 5, 1, 13)
    assert int.from_bytes(light[1:], "big") / 0xFFFF_FFFF * 120_000 == pytest.approx(
        robot.sensors["ambient_light"], abs=0.01
    )
    assert _said(robot, *CLEAR, now=1.06) == []
    assert _said(robot, now=9.0) == []
