"""Masks and streamed payloads in, named readings out."""

import json
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.sensors import (
    SENSORS,
    STREAM_IDS,
    Masks,
    masks_after,
    stream_layout,
    streaming_fields,
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
                "back_emf_left": 7,
                "back_emf_right": 8,
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
            id="the extended one behind the other",
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
    ("payload", "rest", "problem"),
    [
        pytest.param(numbers(1, 2), "", "short payload: yaw needs 2 bytes, 0 left", id="short"),
        pytest.param(
            numbers(1, 2, 3) + b"\7", "07", "1 byte more than the layout has", id="one frame and more"
        ),
        pytest.param(
            numbers(*range(6)) + b"\7\7",
            "0707",
            "2 bytes behind 2 frames of 6 bytes",
            id="two frames and more",
        ),
    ],
)
def test_what_is_no_whole_number_of_frames_is_told(payload: bytes, rest: str, problem: str) -> None:
    decoded = streaming_fields(V1, Masks(ATTITUDE), payload)
    assert (decoded.rest.hex(), decoded.problem) == (rest, problem)


def test_numbers_of_nobody_are_told() -> None:
    assert streaming_fields(V1, Masks(), b"\0\1").problem == "2 bytes more than the layout has"


@given(st.sampled_from(Generation), MASKS, st.binary(max_size=200))
def test_any_payload_decodes_to_plain_json(generation: Generation, masks: Masks, payload: bytes) -> None:
    decoded = streaming_fields(generation, masks, payload)
    json.dumps(decoded.fields, allow_nan=False)
    assert payload.endswith(decoded.rest)
    assert not decoded.rest or decoded.problem


@pytest.mark.parametrize(("generation", "size"), [(V1, 2), (V2, 4)], ids=["v1", "v2"])
def test_sensors_stand_in_the_order_of_the_wire(generation: Generation, size: int) -> None:
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
