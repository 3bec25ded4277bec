"""Names the numbers in a sensor stream, using the masks that were set.

A stream has one number per sensor whose bit is set, the highest bit first; those of the extended mask follow
[code, vendor]. So a number can be named only if the meaning of every bit before it is known: after an unknown
bit, and in a payload of an unexpected length, numbers have no name.

Some bits have two meanings, depending on the source. This module follows the maker's tables (iOS SDK,
JavaScript SDK):

- V1 bits 6 and 5: the right and the left motor; spherov2 has them swapped.
- V2 gyroscope: bits 12-10 of the mask in the maker's apps for Mini and the droids, bits 25-23 of the extended
  mask in the apps for BOLT. spherov2 uses the extended ones with every robot. So Mini and the droids have
  both here, BOLT and BOLT+ have the extended ones, and for an unknown robot both are accepted.
"""

from functools import cache
from typing import Final, NamedTuple

from sphero_probe.catalogue.commands import rows_of
from sphero_probe.catalogue.model import Robot
from sphero_probe.catalogue.payload.layout import Decoded, Layout
from sphero_probe.protocol.packets import Command, Generation


class Sensor(NamedTuple):
    """One sensor of a stream.

    Attributes:
        bit: its bit in the mask, 0-31.
        extended: whether the mask is the extended one.
        field: the format of its number, as a field of a layout: ``pitch:i16[deg]``.
        robots: the keys of the robots that use the bit for this; empty for all of the generation.
    """

    bit: int
    extended: bool
    field: str
    robots: frozenset[str] = frozenset()


class Masks(NamedTuple):
    """The sensors that a robot was told to stream.

    Attributes:
        mask: bits of the sensors, 0 for none.
        extended: bits of the sensors in the extended mask.
    """

    mask: int = 0
    extended: int = 0


_MINI_GENERATION: Final = frozenset(("mini", "r2d2", "r2q5", "bb9e", "lmq"))


def _sensors(
    mask: dict[int, str],
    extended: dict[int, str],
    robots: dict[int, frozenset[str]] = {},  # noqa: B006 - never changed
) -> tuple[Sensor, ...]:
    """Return the sensors in the order of the wire; ``robots``: bit of the mask -> robots that use it."""
    return tuple(
        Sensor(bit, further, field, frozenset() if further else robots.get(bit, frozenset()))
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
            25: "magnetometer_raw_x:i16",
            24: "magnetometer_raw_y:i16",
            23: "magnetometer_raw_z:i16",
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
            9: "magnetometer_x:i16",
            8: "magnetometer_y:i16",
            7: "magnetometer_z:i16",
            6: "back_emf_right:i16",
            5: "back_emf_left:i16",
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
            12: "gyroscope_x:f32[deg/s]",
            11: "gyroscope_y:f32[deg/s]",
            10: "gyroscope_z:f32[deg/s]",
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
        dict.fromkeys((12, 11, 10), _MINI_GENERATION),
    ),
}
"""Every known sensor in the order of the wire, per generation.

Only the maker's tables list the raw sensors of V1 and its magnetometer.
"""

_RAW: Final = {Generation.V1: Layout("values:i16*"), Generation.V2: Layout("values:f32*")}
"""The layout of a stream whose sensors are not known, per generation."""
_WIDTH: Final = {Generation.V1: 2, Generation.V2: 4}
"""Bytes of one number."""
_SEVERAL_FRAMES: Final = {Generation.V1}
"""The generations that put several frames into one notification."""

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
    """Return the masks after a robot has executed a command; most commands change nothing.

    Args:
        generation: the protocol of the robot.
        masks: the masks before; ``Masks()`` for a robot that was just switched on.
        command: the command.
    """
    setter = _SETTERS[generation].get((command.did, command.cid))
    if setter is None:
        return masks
    request = rows_of(generation, command.did, command.cid)[0].request
    fields = request.decode(command.payload).fields if request else {}
    values = {mask: fields.get(field, 0) for field, mask in setter.items()}
    return masks._replace(**{mask: value for mask, value in values.items() if isinstance(value, int)})


def sensors_of(generation: Generation, robot: Robot | None) -> tuple[Sensor, ...]:
    """Return the sensors of a robot in the order of the wire; for None, those of any robot."""
    return _sensors_of(generation, robot.key if robot else "")


def unknown_bits(generation: Generation, masks: Masks, robot: Robot | None = None) -> Masks:
    """Return the bits that are set but belong to no known sensor of this robot."""
    known = Masks()
    for sensor in sensors_of(generation, robot):
        bit = 1 << sensor.bit
        known = Masks(known.mask | (not sensor.extended) * bit, known.extended | sensor.extended * bit)
    return Masks(masks.mask & ~known.mask, masks.extended & ~known.extended)


def streaming_fields(
    generation: Generation, masks: Masks, payload: bytes, robot: Robot | None = None
) -> Decoded:
    """Decode the payload of a streaming notification; no bytes make this raise.

    Args:
        generation: the protocol it came by.
        masks: the masks that were set when it was sent.
        payload: of the notification with ``STREAM_IDS``.
        robot: whose bits they are, None where that is not known.

    Returns:
        Sensor name -> value; where a V1 payload holds several frames, sensor name -> list of values, the
        oldest first. Numbers without a certain name are listed in ``values``, in the order of the wire, and
        ``problem`` says why: which bits are unknown, or which length was expected.
    """
    unknown = unknown_bits(generation, masks, robot)
    if any(unknown):
        return _behind_unknown_bits(generation, masks, payload, robot, unknown)
    layout = stream_layout(generation, masks, robot)
    size = layout.minimum_length
    if not size:
        return _raw(generation, payload, "no sensor was asked for" if payload else "")
    count, surplus = divmod(len(payload), size)
    if surplus or not count or (count > 1 and generation not in _SEVERAL_FRAMES):
        return _raw(generation, payload, f"{len(payload)} bytes, a frame of these sensors has {size}")
    if count == 1:
        return layout.decode(payload)
    frames = [layout.decode(payload[at : at + size]) for at in range(0, len(payload), size)]
    fields: dict[str, object] = {name: [frame.fields[name] for frame in frames] for name in frames[0].fields}
    return Decoded(fields, frames[0].units, b"", "")


def stream_layout(generation: Generation, masks: Masks, robot: Robot | None = None) -> Layout:
    """Return the layout of one frame, without the bits of unknown sensors."""
    return _stream_layout(generation, masks, robot.key if robot else "")


def _behind_unknown_bits(
    generation: Generation, masks: Masks, payload: bytes, robot: Robot | None, unknown: Masks
) -> Decoded:
    """Decode the sensors before the first unknown bit, if the payload is one frame; the rest has no names."""
    words = [f"{1 << bit:#010x}" for bit in _bits(unknown.mask)]
    words += [f"{1 << bit:#010x} of the extended mask" for bit in _bits(unknown.extended)]
    problem = f"unknown sensor bit {', '.join(words)}"
    width = _WIDTH[generation]
    named = len(stream_layout(generation, masks, robot).fields)
    lengths = {named * width, (named + len(words)) * width}
    certain = Masks(masks.mask >> unknown.mask.bit_length() << unknown.mask.bit_length())
    if not unknown.mask:
        highest = unknown.extended.bit_length()
        certain = Masks(masks.mask, masks.extended >> highest << highest)
    head = stream_layout(generation, certain, robot)
    if not head.fields or len(payload) not in lengths:
        return _raw(generation, payload, problem)
    decoded = head.decode(payload[: head.minimum_length])
    rest = _raw(generation, payload[head.minimum_length :], problem)
    return rest._replace(fields=decoded.fields | rest.fields, units=decoded.units)


def _bits(mask: int) -> list[int]:
    """Return the numbers of the bits that are set, the highest first."""
    return [bit for bit in range(31, -1, -1) if mask >> bit & 1]


def _raw(generation: Generation, payload: bytes, problem: str) -> Decoded:
    """Return a payload as numbers without names."""
    if not payload:
        return Decoded({}, {}, b"", problem)
    whole = len(payload) // _WIDTH[generation] * _WIDTH[generation]
    return Decoded(_RAW[generation].decode(payload[:whole]).fields, {}, payload[whole:], problem)


@cache
def _sensors_of(generation: Generation, key: str) -> tuple[Sensor, ...]:
    return tuple(
        sensor for sensor in SENSORS[generation] if not (key and sensor.robots) or key in sensor.robots
    )


@cache
def _stream_layout(generation: Generation, masks: Masks, key: str) -> Layout:
    chosen = [
        sensor
        for sensor in _sensors_of(generation, key)
        if (masks.extended if sensor.extended else masks.mask) >> sensor.bit & 1
    ]
    plain = {sensor.field for sensor in chosen if not sensor.extended}
    return Layout(
        " ".join(
            f"extended_{sensor.field}" if sensor.extended and sensor.field in plain else sensor.field
            for sensor in chosen
        )
    )
