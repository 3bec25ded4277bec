"""What the numbers of a sensor stream are: the masks that were set and a payload come in, named values out.

A stream carries one number per sensor whose bit is set, the highest bit first, those of the extended mask
behind the others [code, vendor].
"""

from functools import cache
from typing import Final, NamedTuple

from sphero_probe.catalogue.commands import rows_of
from sphero_probe.catalogue.payload.layout import Decoded, Layout
from sphero_probe.protocol.packets import Command, Generation


class Sensor(NamedTuple):
    """One source of numbers.

    Attributes:
        bit: its place in its mask, 0-31.
        extended: its mask is the extended one.
        field: how its number is written, as a word of a layout: ``pitch:i16[deg]``.
    """

    bit: int
    extended: bool
    field: str


class Masks(NamedTuple):
    """What a robot was told to stream.

    Attributes:
        mask: bits of the sensors, 0 for none.
        extended: bits of the further sensors.
    """

    mask: int = 0
    extended: int = 0


def _sensors(mask: dict[int, str], extended: dict[int, str]) -> tuple[Sensor, ...]:
    return tuple(
        Sensor(bit, further, field)
        for further, fields in ((False, mask), (True, extended))
        for bit, field in sorted(fields.items(), reverse=True)
    )


SENSORS: Final[dict[Generation, tuple[Sensor, ...]]] = {
    Generation.V1: _sensors(
        {
            31: "accelerometer_raw_x:i16/250[g]",
            30: "accelerometer_raw_y:i16/250[g]",
            29: "accelerometer_raw_z:i16/250[g]",
            28: "gyroscope_raw_x:i16",
            27: "gyroscope_raw_y:i16",
            26: "gyroscope_raw_z:i16",
            22: "back_emf_raw_right:i16",
            21: "back_emf_raw_left:i16",
            20: "pwm_raw_left:i16",
            19: "pwm_raw_right:i16",
            18: "pitch:i16[deg]",
            17: "roll:i16[deg]",
            16: "yaw:i16[deg]",
            15: "accelerometer_x:i16/4096[g]",
            14: "accelerometer_y:i16/4096[g]",
            13: "accelerometer_z:i16/4096[g]",
            12: "gyroscope_x:i16/10[deg/s]",
            11: "gyroscope_y:i16/10[deg/s]",
            10: "gyroscope_z:i16/10[deg/s]",
            6: "back_emf_left:i16",  # spherov2; in the maker's tables 6 is the right motor, 5 the left
            5: "back_emf_right:i16",
        },
        {
            31: "quaternion_x:i16/10000",
            30: "quaternion_y:i16/10000",
            29: "quaternion_z:i16/10000",
            28: "quaternion_w:i16/10000",
            27: "locator_x:i16[cm]",
            26: "locator_y:i16[cm]",
            25: "accel_one:i16/1000[g]",
            24: "velocity_x:i16/10[cm/s]",
            23: "velocity_y:i16/10[cm/s]",
            22: "speed:i16",
        },
    ),
    Generation.V2: _sensors(
        {
            25: "quaternion_x:f32",
            24: "quaternion_y:f32",
            23: "quaternion_z:f32",
            22: "quaternion_w:f32",
            18: "pitch:f32[deg]",
            17: "roll:f32[deg]",
            16: "yaw:f32[deg]",
            15: "accelerometer_x:f32[g]",
            14: "accelerometer_y:f32[g]",
            13: "accelerometer_z:f32[g]",
            9: "accel_one:f32",
            6: "locator_x:f32",
            5: "locator_y:f32",
            4: "velocity_x:f32",
            3: "velocity_y:f32",
            2: "speed:f32",
            1: "core_time:f32[ms]",
        },
        {
            26: "head_angle:f32[deg]",
            25: "gyroscope_x:f32[deg/s]",
            24: "gyroscope_y:f32[deg/s]",
            23: "gyroscope_z:f32[deg/s]",
            18: "ambient_light:f32",
        },
    ),
}
"""Every known sensor in the order of the wire, per generation.

The raw ones of V1 stand in the maker's tables only.
"""

STREAM_IDS: Final[dict[Generation, tuple[int | None, int]]] = {
    Generation.V1: (None, 0x03),
    Generation.V2: (0x18, 0x02),
}
"""The (did, cid) of the notification that carries the numbers, per generation."""

_SETTERS: Final[dict[Generation, dict[tuple[int, int], dict[str, str]]]] = {
    Generation.V1: {(0x02, 0x11): {"mask": "mask", "extended_mask": "extended"}},
    Generation.V2: {(0x18, 0x00): {"sensor_masks": "mask"}, (0x18, 0x0C): {"sensor_masks": "extended"}},
}
"""(did, cid) of a command that sets masks -> field of its request -> mask."""


def masks_after(generation: Generation, masks: Masks, command: Command) -> Masks:
    """Return what is streamed once a robot has executed a command; most commands change nothing.

    Args:
        generation: the protocol of the robot.
        masks: what was streamed before; ``Masks()`` for a robot that was just switched on.
        command: what it executed.
    """
    setter = _SETTERS[generation].get((command.did, command.cid))
    if setter is None:
        return masks
    request = rows_of(generation, command.did, command.cid)[0].request
    fields = request.decode(command.payload).fields if request else {}
    values = {mask: fields.get(field, 0) for field, mask in setter.items()}
    return masks._replace(**{mask: value for mask, value in values.items() if isinstance(value, int)})


def streaming_fields(generation: Generation, masks: Masks, payload: bytes) -> Decoded:
    """Take the payload of a streaming notification apart; whatever the bytes are, this never raises.

    Args:
        generation: the protocol it came by.
        masks: the masks that were set when it was sent.
        payload: of the notification with ``STREAM_IDS``.

    Returns:
        Sensor name -> value; where the payload holds several frames, sensor name -> list of values, the
        oldest first. What is left of a payload that is no whole number of frames is its ``rest``.
    """
    layout = stream_layout(generation, masks)
    size = layout.minimum_length
    count = len(payload) // size if size else 0
    if count < 2:
        return layout.decode(payload)
    frames = [layout.decode(payload[at : at + size]) for at in range(0, count * size, size)]
    rest = payload[count * size :]
    return Decoded(
        {name: [frame.fields[name] for frame in frames] for name in frames[0].fields},
        frames[0].units,
        rest,
        f"{len(rest)} bytes behind {count} frames of {size} bytes" if rest else "",
    )


@cache
def stream_layout(generation: Generation, masks: Masks) -> Layout:
    """Return the layout of one frame; bits of no known sensor are taken to send nothing."""
    chosen = (
        sensor.field
        for sensor in SENSORS[generation]
        if (masks.extended if sensor.extended else masks.mask) >> sensor.bit & 1
    )
    return Layout(" ".join(chosen))
