"""The numbers of sensor streams and their names."""

import json
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.sensors import (
    SENSORS,
    STREAM_IDS,
    Masks,
    masks_after,
    stream_layout,
    streaming_fields,
    unknown_bits,
)
from sphero_probe.protocol.packets import Command, Generation

V1, V2 = Generation.V1, Generation.V2
MASKS = st.builds(Masks, st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
ATTITUDE = 0x0007_0000


def numbers(*values: int) -> bytes:
    return struct.pack(f">{len(values)}h", *values)


@pytest.mark.parametrize(
    ("generation", "masks", "payload", "fields"),
    [
        pytest.param(
            V1, Masks(ATTITUDE), numbers(-179, 5, 180), {"pitch": -179, "roll": 5, "yaw": 180}, id="attitude"
        ),
        pytest.param(
            V1,
            Masks(0x0000_E000),
            numbers(4096, -4096, 2048),
            {"accelerometer_x": 1.0, "accelerometer_y": -1.0, "accelerometer_z": 0.5},
            id="acceleration",
        ),
        pytest.param(
            V1,
            Masks(0x0000_1C60),
            numbers(-15, 0, 20000, 7, 8),
            {
                "gyroscope_x": -1.5,
                "gyroscope_y": 0.0,
                "gyroscope_z": 2000.0,
                "back_emf_right": 7,
                "back_emf_left": 8,
            },
            id="gyroscope and motors",
        ),
        pytest.param(
            V1,
            Masks(extended=0xFFC0_0000),
            numbers(0, 0, 0, 10000, -5, 6, 8000, 10, -10, 3),
            {
                "quaternion_x": 0.0,
                "quaternion_y": 0.0,
                "quaternion_z": 0.0,
                "quaternion_w": 1.0,
                "locator_x": -5,
                "locator_y": 6,
                "accel_one": 8.0,
                "velocity_x": 1.0,
                "velocity_y": -1.0,
                "speed": 3,
            },
            id="extended",
        ),
        pytest.param(
            V1,
            Masks(0x0001_0000, 0x0040_0000),
            numbers(90, 12),
            {"yaw": 90, "speed": 12},
            id="the extended one after the other",
        ),
        pytest.param(
            V1,
            Masks(0xE000_0000),
            numbers(250, 0, -2048),
            {"accelerometer_raw_x": 1.0, "accelerometer_raw_y": 0.0, "accelerometer_raw_z": -8.192},
            id="raw, 4 mg a step",
        ),
        pytest.param(
            V1,
            Masks(ATTITUDE),
            numbers(1, 2, 3, 4, 5, 6),
            {"pitch": [1, 4], "roll": [2, 5], "yaw": [3, 6]},
            id="two frames",
        ),
        pytest.param(
            V2,
            Masks(0x0000_2000, 0x0400_0000),
            struct.pack(">2f", 1.0, -12.5),
            {"accelerometer_z": 1.0, "head_angle": -12.5},
            id="V2",
        ),
        pytest.param(V1, Masks(), b"", {}, id="nothing"),
    ],
)
def test_streaming_fields(
    generation: Generation, masks: Masks, payload: bytes, fields: dict[str, Any]
) -> None:
    decoded = streaming_fields(generation, masks, payload)
    assert decoded.fields == fields
    assert (decoded.rest, decoded.problem) == (b"", "")


def test_units_go_with_the_fields() -> None:
    decoded = streaming_fields(V1, Masks(ATTITUDE, 0x0800_0000), numbers(1, 2, 3, 4))
    assert decoded.units == {"pitch": "deg", "roll": "deg", "yaw": "deg", "locator_x": "cm"}


@pytest.mark.parametrize(
    ("generation", "payload", "values", "rest", "problem"),
    [
        pytest.param(V1, numbers(1, 2), [1, 2], "", "4 bytes, a frame of these sensors has 6", id="short"),
        pytest.param(
            V1,
            numbers(1, 2, 3) + b"\7",
            [1, 2, 3],
            "07",
            "7 bytes, a frame of these sensors has 6",
            id="a frame and more",
        ),
        pytest.param(
            V1,
            numbers(*range(6)) + b"\7\7",
            [0, 1, 2, 3, 4, 5, 0x707],
            "",
            "14 bytes, a frame of these sensors has 6",
            id="two frames and more",
        ),
        pytest.param(
            V2,
            struct.pack(">6f", *range(6)),
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
            "",
            "24 bytes, a frame of these sensors has 12",
            id="V2 has one frame at a time",
        ),
        pytest.param(V1, b"", None, "", "0 bytes, a frame of these sensors has 6", id="nothing at all"),
    ],
)
def test_numbers_of_an_unexpected_length_have_no_names(
    generation: Generation, payload: bytes, values: list[object] | None, rest: str, problem: str
) -> None:
    decoded = streaming_fields(generation, Masks(ATTITUDE), payload)
    assert decoded == ({} if values is None else {"values": values}, {}, bytes.fromhex(rest), problem)


def test_numbers_that_were_not_requested_have_no_names() -> None:
    assert streaming_fields(V1, Masks(), b"\0\1") == ({"values": [1]}, {}, b"", "no sensor was asked for")


def test_the_motors_and_the_magnetometer_of_v1_are_those_of_the_maker() -> None:
    """RKSetDataStreamingCommand.h of the maker's iOS SDK; sphero.js and gobot have the same motors."""
    words = {sensor.field.partition(":")[0]: sensor.bit for sensor in SENSORS[V1] if not sensor.extended}
    assert {
        "back_emf_left": 0x20,
        "back_emf_right": 0x40,
        "magnetometer_z": 0x80,
        "magnetometer_y": 0x100,
        "magnetometer_x": 0x200,
        "gyroscope_z": 0x400,
        "gyroscope_x": 0x1000,
        "accelerometer_x": 0x8000,
        "yaw": 0x1_0000,
        "pitch": 0x4_0000,
        "back_emf_raw_left": 0x20_0000,
        "back_emf_raw_right": 0x40_0000,
        "magnetometer_raw_z": 0x80_0000,
        "magnetometer_raw_y": 0x100_0000,
        "magnetometer_raw_x": 0x200_0000,
        "gyroscope_raw_z": 0x400_0000,
        "accelerometer_raw_x": 0x8000_0000,
    }.items() <= {name: 1 << bit for name, bit in words.items()}.items()


def test_a_magnetometer_between_does_not_make_a_resting_robot_turn() -> None:
    """A regression test: the numbers after an unknown bit were named as if the bit sent no number."""
    masks = Masks(0x0000_03E0)
    decoded = streaming_fields(V1, masks, numbers(100, -200, 300, 1, 2))
    assert decoded.fields == {
        "magnetometer_x": 100,
        "magnetometer_y": -200,
        "magnetometer_z": 300,
        "back_emf_right": 1,
        "back_emf_left": 2,
    }


GYROSCOPE = struct.pack(">6f", 0.25, 0.5, 1.0, -2.5, 3.0, 4.5)
MINI_MASK = Masks(0x0000_FC00)
"""Accelerometer and gyroscope, with the masks that the maker's apps set on a Mini."""
ACCELEROMETER = {"accelerometer_x": 0.25, "accelerometer_y": 0.5, "accelerometer_z": 1.0}


@pytest.mark.parametrize("key", ["mini", "r2d2", "r2q5", "bb9e", "lmq", None])
def test_bits_12_to_10_are_the_gyroscope_of_mini_and_the_droids(key: str | None) -> None:
    """gyroXFilteredV2 … of the maker's Swift app template (SensorControlV2.swift) and of spherov2.js."""
    decoded = streaming_fields(V2, MINI_MASK, GYROSCOPE, ROBOTS[key] if key else None)
    gyroscope = {"gyroscope_x": -2.5, "gyroscope_y": 3.0, "gyroscope_z": 4.5}
    assert decoded == (
        ACCELEROMETER | gyroscope,
        dict.fromkeys(ACCELEROMETER, "g") | dict.fromkeys(gyroscope, "deg/s"),
        b"",
        "",
    )


@pytest.mark.parametrize("key", ["bolt", "bolt-plus"])
def test_on_bolt_the_same_bits_are_unknown_and_name_nothing_behind_them(key: str) -> None:
    decoded = streaming_fields(V2, MINI_MASK, GYROSCOPE, ROBOTS[key])
    assert decoded.fields == ACCELEROMETER | {"values": [-2.5, 3.0, 4.5]}
    assert decoded.problem == "unknown sensor bit 0x00001000, 0x00000800, 0x00000400"
    assert unknown_bits(V2, MINI_MASK, ROBOTS[key]) == Masks(0x1C00, 0)


@pytest.mark.parametrize("key", ["bolt", "mini", None])
def test_the_extended_bits_of_spherov2_are_a_gyroscope_too(key: str | None) -> None:
    decoded = streaming_fields(V2, Masks(0, 0x0380_0000), GYROSCOPE[:12], ROBOTS[key] if key else None)
    assert decoded.fields == {"gyroscope_x": 0.25, "gyroscope_y": 0.5, "gyroscope_z": 1.0}
    both = streaming_fields(V2, Masks(0x1C00, 0x0380_0000), GYROSCOPE, ROBOTS["mini"])
    assert list(both.fields) == [
        f"{prefix}gyroscope_{axis}" for prefix in ("", "extended_") for axis in "xyz"
    ]


@pytest.mark.parametrize(
    ("masks", "payload", "fields", "problem"),
    [
        pytest.param(
            Masks(ATTITUDE | 0x10),
            numbers(1, 2, 3, 4),
            {"pitch": 1, "roll": 2, "yaw": 3, "values": [4]},
            "unknown sensor bit 0x00000010",
            id="what comes before it is certain",
        ),
        pytest.param(
            Masks(ATTITUDE | 0x10),
            numbers(1, 2, 3),
            {"pitch": 1, "roll": 2, "yaw": 3},
            "unknown sensor bit 0x00000010",
            id="it sends nothing",
        ),
        pytest.param(
            Masks(ATTITUDE | 0x10),
            numbers(1, 2, 3, 4, 5),
            {"values": [1, 2, 3, 4, 5]},
            "unknown sensor bit 0x00000010",
            id="neither length",
        ),
        pytest.param(
            Masks(ATTITUDE | 0x10),
            numbers(*range(12)),
            {"values": [*range(12)]},
            "unknown sensor bit 0x00000010",
            id="three frames of four or four of three",
        ),
        pytest.param(
            Masks(0x0008_0000 | 0x10, 0x0400_0000),
            numbers(1, 2, 3),
            {"pwm_raw_right": 1, "values": [2, 3]},
            "unknown sensor bit 0x00000010",
            id="the extended ones come after it",
        ),
        pytest.param(
            Masks(0x0001_0000, 0x0400_0001),
            numbers(1, 2, 3),
            {"yaw": 1, "locator_y": 2, "values": [3]},
            "unknown sensor bit 0x00000001 of the extended mask",
            id="extended",
        ),
    ],
)
def test_numbers_after_an_unknown_bit_have_no_names(
    masks: Masks, payload: bytes, fields: dict[str, object], problem: str
) -> None:
    decoded = streaming_fields(V1, masks, payload)
    assert (decoded.fields, decoded.problem) == (fields, problem)


@given(st.sampled_from(Generation), MASKS, st.binary(max_size=200))
def test_any_payload_decodes_to_plain_json(generation: Generation, masks: Masks, payload: bytes) -> None:
    decoded = streaming_fields(generation, masks, payload)
    json.dumps(decoded.fields, allow_nan=False)
    assert payload.endswith(decoded.rest)
    assert not decoded.rest or decoded.problem


@pytest.mark.parametrize(("generation", "size"), [(V1, 2), (V2, 4)], ids=["v1", "v2"])
def test_sensors_are_in_the_order_of_the_wire(generation: Generation, size: int) -> None:
    sensors = SENSORS[generation]
    places = [(sensor.extended, -sensor.bit) for sensor in sensors]
    assert places == sorted(places)
    assert len(set(places)) == len(places)
    everything = stream_layout(generation, Masks(2**32 - 1, 2**32 - 1))
    assert len(everything.fields) == len(sensors)
    assert everything.fixed_length == size * len(sensors)


@pytest.mark.parametrize(
    ("generation", "command", "masks"),
    [
        pytest.param(
            V1,
            Command(2, 0x11, bytes.fromhex("0028000100070000 00 00800000")),
            Masks(0x70000, 0x800000),
            id="V1",
        ),
        pytest.param(
            V1, Command(2, 0x11, bytes.fromhex("0028000100070000 00")), Masks(0x70000), id="V1, short"
        ),
        pytest.param(V1, Command(2, 0x11, b"\0"), Masks(), id="V1, damaged"),
        pytest.param(V1, Command(2, 0x12, bytes(6)), Masks(1, 2), id="V1, another command"),
        pytest.param(V2, Command(0x18, 0x00, bytes.fromhex("00fa 00 00070000")), Masks(0x70000, 2), id="V2"),
        pytest.param(
            V2, Command(0x18, 0x0C, bytes.fromhex("04000000")), Masks(1, 0x4000000), id="V2, extended"
        ),
        pytest.param(V2, Command(0x02, 0x11, bytes(13)), Masks(1, 2), id="V2, another command"),
    ],
)
def test_masks_after(generation: Generation, command: Command, masks: Masks) -> None:
    assert masks_after(generation, Masks(1, 2), command) == masks


def test_the_notifications_that_carry_streams() -> None:
    assert STREAM_IDS == {V1: (None, 0x03), V2: (0x18, 0x02)}
