"""The commands that stream sensors: against spherov2's SensorControl and the maker's service table."""

import json
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from spherov2.controls.v2 import SensorControl
from spherov2.toy.bolt import BOLT
from spherov2.toy.mini import Mini
from spherov2.toy.r2d2 import R2D2

from sphero_probe.catalogue import ROBOTS, rows_of
from sphero_probe.catalogue.stream_plan import sensor_groups, stream_plan
from sphero_probe.catalogue.switches import switched_off, taken_back
from sphero_probe.errors import UsageError
from sphero_probe.protocol.packets import Command, Generation
from tests.support.narrowing import known

BY_MASKS = {"bolt": BOLT, "mini": Mini, "r2d2": R2D2}
GYROSCOPE_OF_THE_MASK = {"mini", "r2d2"}
"""The maker's apps use bits 12-10 of the mask with these, spherov2 the extended mask with all."""


def spherov2_masks(key: str, sensors: list[str]) -> dict[str, int]:
    """Return the masks that spherov2 sets to enable sensors."""
    said: dict[str, int] = {}
    toy = SimpleNamespace(
        add_sensor_streaming_data_notify_listener=lambda _: None,
        sensors=BY_MASKS[key].sensors,
        extended_sensors=BY_MASKS[key].extended_sensors,
        set_sensor_streaming_mask=lambda _interval, _count, mask: said.update(mask=mask),
        set_extended_sensor_streaming_mask=lambda mask: said.update(extended=mask),
    )
    SensorControl(toy).enable(*sensors)
    return said


def our_masks(commands: tuple[Command, ...]) -> dict[str, int]:
    masks = {"mask": 0, "extended": 0}
    for command in commands:
        request = known(rows_of(Generation.V2, command.did, command.cid)[0].request)
        value = request.decode(command.payload).fields["sensor_masks"]
        masks["mask" if command.cid == 0x00 else "extended"] = int(str(value))
    return masks


@pytest.mark.parametrize("key", BY_MASKS)
@pytest.mark.parametrize("sensors", [["accelerometer"], ["attitude", "quaternion"], ["locator", "velocity"]])
def test_the_masks_are_those_of_spherov2(key: str, sensors: list[str]) -> None:
    plan = stream_plan(ROBOTS[key], 1, sensors, 10)
    assert our_masks(plan.start) == spherov2_masks(key, sensors)


def test_the_gyroscope_is_where_the_makers_apps_have_it() -> None:
    assert our_masks(stream_plan(ROBOTS["bolt"], 1, ["gyro"], 10).start) == spherov2_masks(
        "bolt", ["gyroscope"]
    )
    for key in GYROSCOPE_OF_THE_MASK:
        assert our_masks(stream_plan(ROBOTS[key], 1, ["gyro"], 10).start) == {"mask": 0x1C00, "extended": 0}


SDK = {
    "quaternion": (0x00, 2),
    "attitude": (0x01, 2),
    "accelerometer": (0x02, 2),
    "color_detection": (0x03, 1),
    "gyroscope": (0x04, 2),
    "locator": (0x06, 2),
    "velocity": (0x07, 2),
    "speed": (0x08, 2),
    "ambient_light": (0x0A, 1),
    "encoders": (0x0B, 2),
}
"""Sensor -> id and node of its service [sphero-sdk-raspberrypi-python, sensor_streaming_control.py]."""
SDK_SIZES = {0x03: 0}
"""Id -> size byte that the SDK uses, 2 (32 bits) for all others [the same table]."""


@pytest.mark.parametrize("sensor", SDK)
def test_the_services_of_rvr_are_configured_as_the_sdk_does(sensor: str) -> None:
    number, node = SDK[sensor]
    configure, start = stream_plan(ROBOTS["rvr"], 1, [sensor], 4).start
    assert configure.payload == bytes([1, 0, number, SDK_SIZES.get(number, 2)])
    assert (configure.target, start.target) == (0x10 | node,) * 2
    assert start.payload == (250).to_bytes(2, "big")


def test_both_nodes_of_rvr_and_more_services_than_one_token_holds() -> None:
    plan = stream_plan(ROBOTS["rvr"], 1, ["all"], 10)
    tokens = [(command.target, command.payload[0]) for command in plan.start if command.cid == 0x39]
    assert tokens == [(0x11, 1), (0x12, 1), (0x12, 2)]
    assert all(len(command.payload) <= 1 + 5 * 3 for command in plan.start)
    off = taken_back(Generation.V2, plan.start)
    assert sorted((command.target, command.cid) for command in off) == [
        (0x11, 0x3B),
        (0x11, 0x3C),
        (0x12, 0x3B),
        (0x12, 0x3C),
    ]


def test_a_first_generation_robot_divides_its_400_hz() -> None:
    (command,) = stream_plan(ROBOTS["bb8"], 1, ["accelerometer"], 10).start
    assert command.payload.hex() == "002800010000e0000000000000"
    (off,) = taken_back(Generation.V1, [command])
    assert off.payload.hex() == "00280001000000000000000000"


@pytest.mark.parametrize(
    ("command", "off"),
    [
        pytest.param("0x13:0x1b 01", "0x13:0x1b 00", id="enable"),
        pytest.param("0x13:0x1b 00", None, id="it-switches-off-already"),
        pytest.param("0x18:0x35 010064ff", "0x18:0x35 000064ff", id="other-arguments-stay"),
        pytest.param("0x13:0x10", None, id="a-query"),
        pytest.param("0x18:0x3a 0064", "0x18:0x3b", id="streaming-services"),
    ],
)
def test_what_takes_a_command_back(command: str, off: str | None) -> None:
    def read(text: str) -> Command:
        pair, _, payload = text.partition(" ")
        did, cid = (int(part, 16) for part in pair.split(":"))
        return Command(did, cid, bytes.fromhex(payload), 0x11)

    assert switched_off(Generation.V2, read(command)) == (off and read(off))


@pytest.mark.parametrize("key", ROBOTS)
def test_every_sensor_of_every_robot_can_be_streamed(key: str) -> None:
    robot = ROBOTS[key]
    for group, columns in sensor_groups(robot).items():
        assert stream_plan(robot, 1, [group], 20).columns == columns
        for column in columns:
            assert stream_plan(robot, 1, [column.name], 20).columns == (column,)


@given(st.text(max_size=20), st.sampled_from([None, *ROBOTS.values()]))
def test_any_other_name_is_refused(name: str, robot: Any) -> None:
    if robot and name.strip().lower().replace("-", "_") in json.dumps(sensor_groups(robot)):
        return
    if name.strip().lower() in {"gyro", "imu", "accel", "light", "all"}:
        return
    with pytest.raises(UsageError):
        stream_plan(robot, 1, [name], 10)


def test_a_near_name_is_suggested() -> None:
    with pytest.raises(UsageError) as caught:
        stream_plan(ROBOTS["bolt"], 1, ["acelerometer"], 10)
    assert "did you mean 'accelerometer'" in caught.value.hint
