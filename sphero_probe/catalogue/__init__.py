"""What is known about robots and their commands: look-ups by id and by name."""

from sphero_probe.catalogue.commands import (
    BRICK_DEVICES,
    DEVICE_NAMES,
    MOVING_DEVICES,
    NO_EMPTY_PROBE_DEVICES,
    PERSIST_DEVICES,
    all_rows,
    async_rows,
    close_names,
    commands_of,
    device_by_name,
    devices_of,
    lookup,
    notification_row,
    row_by_name,
    rows_of,
)
from sphero_probe.catalogue.robots import ROBOTS, robot_by_prefix, robot_by_word

__all__ = [
    "BRICK_DEVICES",
    "DEVICE_NAMES",
    "MOVING_DEVICES",
    "NO_EMPTY_PROBE_DEVICES",
    "PERSIST_DEVICES",
    "ROBOTS",
    "all_rows",
    "async_rows",
    "close_names",
    "commands_of",
    "device_by_name",
    "devices_of",
    "lookup",
    "notification_row",
    "robot_by_prefix",
    "robot_by_word",
    "row_by_name",
    "rows_of",
]
