"""The commands that switch the sensor streams of a robot on and off, from the names of sensors.

A sensor is named alone (``pitch``, ``accelerometer_x``) or with its group (``attitude``, ``accelerometer``).
Most robots take masks of sensors; RVR takes services that are configured per node.
"""

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from sphero_probe.catalogue.commands import commands_of, row_by_name
from sphero_probe.catalogue.model import CommandRow, Robot
from sphero_probe.catalogue.payload.fields import parse_field
from sphero_probe.catalogue.sensors import Masks, Sensor, sensors_of
from sphero_probe.catalogue.streaming_services import (
    BITS,
    CONFIGURE,
    MOST_SERVICES,
    SERVICES,
    START,
    TOKENS,
    Service,
)
from sphero_probe.errors import UsageError, did_you_mean
from sphero_probe.protocol.address import Address
from sphero_probe.protocol.packets import Command, Generation

V1_RATE: Final = 400.0
"""Samples per second of a V1 robot, before its divisor [vendor: "Set Data Streaming"]."""
ALIASES: Final = {"gyro": "gyroscope", "imu": "attitude", "accel": "accelerometer", "light": "ambient_light"}
_ATTITUDE: Final = ("pitch", "roll", "yaw")
_AXES: Final = ("_x", "_y", "_z", "_w", "_left", "_right", "_upper", "_lower")


class StreamColumn(NamedTuple):
    """One value of a stream: its name, and its unit or an empty text."""

    name: str
    unit: str


class StreamPlan(NamedTuple):
    """How to stream some sensors.

    Attributes:
        start: the commands that switch the streams on, in order; ``switches`` has their opposites.
        columns: the values that arrive, in the order in which they were asked for.
        interval: seconds between two samples.
    """

    start: tuple[Command, ...]
    columns: tuple[StreamColumn, ...]
    interval: float


def sensor_groups(robot: Robot) -> dict[str, tuple[StreamColumn, ...]]:
    """Return the sensors of a robot: group -> its values; empty where none are known."""
    groups: dict[str, list[StreamColumn]] = {}
    for column, group in _columns(robot):
        if column not in groups.setdefault(group, []):
            groups[group].append(column)
    return {group: tuple(columns) for group, columns in groups.items()}


def stream_plan(robot: Robot | None, port: int, sensors: Sequence[str], rate: float) -> StreamPlan:
    """Return the commands that stream these sensors.

    Args:
        robot: the model, None if it is not known.
        port: the port nibble of this kind of connection.
        sensors: names of groups or of single values.
        rate: samples per second.

    Raises:
        UsageError: the model has no such sensor, or cannot stream as asked.
    """
    groups = sensor_groups(robot) if robot else {}
    if robot is None or not groups:
        raise UsageError(f"no sensor streams are known of {robot.name if robot else 'an unknown model'}")
    wanted = [column for name in sensors for column in _named(name, groups, robot)]
    columns = tuple(dict.fromkeys(wanted))
    if _uses_services(robot):
        return _by_services(robot, port, columns, rate)
    return _by_masks(robot, port, columns, rate)


def _named(name: str, groups: dict[str, tuple[StreamColumn, ...]], robot: Robot) -> tuple[StreamColumn, ...]:
    word = name.strip().lower().replace("-", "_")
    word = ALIASES.get(word, word)
    if word == "all":
        return tuple(column for columns in groups.values() for column in columns)
    if word in groups:
        return groups[word]
    single = {column.name: column for columns in groups.values() for column in columns}
    if word in single:
        return (single[word],)
    raise UsageError(
        f"{robot.name} has no sensor '{name}'",
        did_you_mean(word, [*groups, *single], f"known: {', '.join(groups)}"),
    )


def _columns(robot: Robot) -> Iterable[tuple[StreamColumn, str]]:
    """Yield each value of a robot's streams with its group."""
    if _uses_services(robot):
        for service in SERVICES.values():
            if _node_of(service, robot) is not None:
                for channel in service.channels:
                    yield StreamColumn(channel.name, channel.unit), _group(service.name)
    elif _setter(robot, robot.generation):
        for sensor in sensors_of(robot.generation, robot):
            field = parse_field(sensor.field)
            yield StreamColumn(field.name, field.unit), _group_of(field.name)


def _group(service: str) -> str:
    return "attitude" if service == "imu" else service


def _group_of(name: str) -> str:
    """Return the group of a value: ``accelerometer`` for ``accelerometer_x``."""
    if name in _ATTITUDE:
        return "attitude"
    return next((name.removesuffix(axis) for axis in _AXES if name.endswith(axis)), name)


def _rows(robot: Robot) -> dict[tuple[int, int], CommandRow]:
    return {(row.did, row.cid): row for row in commands_of(robot)}


def _uses_services(robot: Robot) -> bool:
    return CONFIGURE in _rows(robot)


def _setter(robot: Robot, generation: Generation, *, extended: bool = False) -> CommandRow | None:
    """Return the command that sets a mask, None where the robot has none."""
    names = {
        Generation.V1: ("sphero.set_data_streaming",) * 2,
        Generation.V2: ("sensor.set_sensor_streaming_mask", "sensor.set_extended_sensor_streaming_mask"),
    }
    row = row_by_name(generation, names[generation][extended])
    return row if row and robot.key in row.nodes else None


def _by_masks(robot: Robot, port: int, columns: tuple[StreamColumn, ...], rate: float) -> StreamPlan:
    masks = Masks()
    left = {column.name for column in columns}
    for sensor in sensors_of(robot.generation, robot):
        name = parse_field(sensor.field).name
        if name in left:
            left.discard(name)
            masks = _with(masks, sensor)
    if robot.generation is Generation.V1:
        divisor = max(1, round(V1_RATE / rate))
        start = _masked(robot, port, masks, divisor=divisor, frames=1)
        return StreamPlan((start,), columns, divisor / V1_RATE)
    interval = max(1, round(1000 / rate))
    further = _extended(robot, port, masks) if masks.extended else ()
    # the extended mask is sent first: the robot begins to stream when the other one is set
    return StreamPlan((*further, _masked(robot, port, masks, interval=interval)), columns, interval / 1000)


def _with(masks: Masks, sensor: Sensor) -> Masks:
    bit = 1 << sensor.bit
    if sensor.extended:
        return masks._replace(extended=masks.extended | bit)
    return masks._replace(mask=masks.mask | bit)


def _masked(robot: Robot, port: int, masks: Masks, **timing: int) -> Command:
    """Return the command that sets the mask; in V1 both masks."""
    row = _setter(robot, robot.generation)
    values: dict[str, object] = {**timing, "count": 0}
    if robot.generation is Generation.V1:
        values |= {"mask": masks.mask, "extended_mask": masks.extended}
    else:
        values["sensor_masks"] = masks.mask
    return _command(robot, port, row, values)


def _extended(robot: Robot, port: int, masks: Masks) -> tuple[Command, ...]:
    row = _setter(robot, robot.generation, extended=True)
    return (_command(robot, port, row, {"sensor_masks": masks.extended}),) if row else ()


def _command(robot: Robot, port: int, row: CommandRow | None, values: dict[str, object]) -> Command:
    if row is None or row.request is None:
        raise UsageError(f"no sensor streams are known of {robot.name}")
    addressed = robot.generation is not Generation.V1 and robot.nodes
    target = Address(port, row.nodes[robot.key][0]).byte if addressed else None
    return Command(row.did, row.cid, row.request.encode(values), target)


def _node_of(service: Service, robot: Robot) -> int | None:
    """Return the first node of a robot that has a service."""
    nodes = _rows(robot)[CONFIGURE].nodes[robot.key]
    return next((node for node in service.nodes if node in nodes), None)


def _by_services(robot: Robot, port: int, columns: tuple[StreamColumn, ...], rate: float) -> StreamPlan:
    wanted = {column.name for column in columns}
    by_node: dict[int, list[Service]] = {}
    for service in SERVICES.values():
        node = _node_of(service, robot)
        if node is not None and wanted & {channel.name for channel in service.channels}:
            by_node.setdefault(node, []).append(service)
    period = max(1, round(1000 / rate))
    start: list[Command] = []
    for node, services in sorted(by_node.items()):
        target = Address(port, node).byte
        if len(services) > MOST_SERVICES * len(TOKENS):
            raise UsageError(
                "too many sensors at once", f"at most {MOST_SERVICES * len(TOKENS)} services per node"
            )
        for token, at in zip(TOKENS, range(0, len(services), MOST_SERVICES), strict=False):
            entries = b"".join(_entry(service) for service in services[at : at + MOST_SERVICES])
            start.append(Command(*CONFIGURE, bytes([token]) + entries, target))
        start.append(Command(*START, period.to_bytes(2, "big"), target))
    return StreamPlan(tuple(start), columns, period / 1000)


def _entry(service: Service) -> bytes:
    """Return a service in a configuration: its id and the size of its values.

    The maker's SDK uses 8 bits for the colour sensor and 32 for all others [sdk: the service table].
    """
    small = any(channel.whole and channel.maximum <= 0xFF for channel in service.channels)
    size = next(size for size, bits in BITS.items() if bits == (8 if small else 32))
    return service.id.to_bytes(2, "big") + bytes([size])
