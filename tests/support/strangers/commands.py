"""The commands of the strangers: a small table copied from published sources, and unpublished ones.

Numbers, lengths and names are those of ``facts/commands_v2.json`` and ``commands_v1.json``; the class of each
follows from what its name says it does. A command without a name is in no published list.
"""

from enum import IntEnum
from typing import NamedTuple

ANY = 4096
"""No upper limit to the length of the arguments."""


class Effect(IntEnum):
    """What happens when a command runs."""

    READ = 0
    WRITE = 1
    MOTION = 2
    PERSIST = 3
    BRICK = 4


class Row(NamedTuple):
    """One command of one node.

    Attributes:
        node: where it is.
        did: device id.
        cid: command id.
        name: as published; empty for an unpublished command.
        effect: what it does.
        shortest: the fewest bytes of arguments that it accepts.
        longest: the most bytes of arguments that it accepts.
        answer: what it answers.
        idle: arguments of zeros change nothing: no LED selected, a notification switched off that is already
            off.
        limit: the highest first byte that it accepts.
        from_one: a first byte of 0 is rejected, too.
    """

    node: int
    did: int
    cid: int
    name: str
    effect: Effect
    shortest: int = 0
    longest: int = 0
    answer: bytes = b""
    idle: bool = False
    limit: int = 255
    from_one: bool = False

    @property
    def pair(self) -> tuple[int, int]:
        return self.did, self.cid

    @property
    def triple(self) -> tuple[int, int, int]:
        return self.node, self.did, self.cid


def _read(node: int, did: int, cid: int, name: str, answer: bytes, takes: int = 0) -> Row:
    return Row(node, did, cid, name, Effect.READ, takes, takes, answer)


def _act(node: int, did: int, cid: int, name: str, effect: Effect, takes: int, longest: int = -1) -> Row:
    return Row(node, did, cid, name, effect, takes, takes if longest < 0 else longest)


def _idle(node: int, did: int, cid: int, name: str, takes: int, longest: int = -1) -> Row:
    return _act(node, did, cid, name, Effect.WRITE, takes, longest)._replace(idle=True)


def _api(node: int) -> list[Row]:
    return [
        Row(node, 0x10, 0x00, "ping", Effect.READ, 0, 16),
        _read(node, 0x10, 0x01, "get_api_protocol_version", b"\x02\x00"),
        _act(node, 0x10, 0x02, "send_command_to_shell", Effect.BRICK, 1, ANY),
        _read(node, 0x10, 0x05, "get_supported_dids", b""),
        _read(node, 0x10, 0x06, "get_supported_cids", b"", 1),
        _read(node, 0x11, 0x00, "get_main_app_version", bytes.fromhex("000700010004")),
        _read(node, 0x11, 0x01, "get_bootloader_version", bytes.fromhex("000400010000")),
        _read(node, 0x11, 0x1F, "get_processor_name", b"stranger\x00"),
    ]


_SYSTEM = [
    _read(1, 0x11, 0x03, "get_board_revision", b"\x02"),
    _read(1, 0x11, 0x06, "get_mac_address", b"a1b2c3d4e5f6"),
    _read(1, 0x11, 0x13, "get_stats_id", b"\x00\x07"),
    _read(1, 0x11, 0x20, "get_boot_reason", b"\x00"),
    _act(1, 0x11, 0x2B, "write_config_block", Effect.BRICK, 0),
    _act(1, 0x11, 0x2D, "set_config_block", Effect.BRICK, 8, ANY),
    _act(1, 0x11, 0x2E, "erase_config_block", Effect.BRICK, 4),
    _read(1, 0x11, 0x38, "get_sku", b"ST01ROW\x00"),
    _act(1, 0x11, 0x1C, "", Effect.PERSIST, 2),
]
_POWER = [
    _act(1, 0x13, 0x00, "enter_deep_sleep", Effect.BRICK, 1),
    _act(1, 0x13, 0x01, "sleep", Effect.MOTION, 0),
    _read(1, 0x13, 0x0D, "wake", b""),
    _read(1, 0x13, 0x17, "get_battery_voltage_state", b"\x01"),
    _idle(1, 0x13, 0x1B, "enable_battery_voltage_state_change_notify", 1),
    _act(1, 0x13, 0x2E, "", Effect.MOTION, 0),
    _read(1, 0x13, 0x33, "", b"\x2a"),
]
_BOLT_POWER = [
    _read(1, 0x13, 0x03, "get_battery_voltage", b"\x01\x90"),
    _read(1, 0x13, 0x1F, "get_charger_state", b"\x01"),
    _idle(1, 0x13, 0x20, "enable_charger_state_changed_notify", 1),
]
_NAMES = [
    _act(1, 0x19, 0x03, "set_bluetooth_name", Effect.PERSIST, 0, 64),
    _read(1, 0x19, 0x04, "get_bluetooth_name", b"Stranger\x00"),
    _act(1, 0x19, 0x0B, "", Effect.PERSIST, 1),
]
_BOLT_LEDS = [
    _idle(1, 0x1A, 0x1C, "set_all_leds_with_8_bit_mask", 1, 9),
    _act(1, 0x1A, 0x4E, "release_led_requests", Effect.WRITE, 0),
    _act(1, 0x1A, 0x27, "", Effect.WRITE, 3),
]


def _drive(node: int) -> list[Row]:
    return [
        _act(node, 0x16, 0x01, "set_raw_motors", Effect.MOTION, 4),
        _act(node, 0x16, 0x06, "reset_yaw", Effect.WRITE, 0),
        _act(node, 0x16, 0x07, "drive_with_heading", Effect.MOTION, 4)._replace(limit=100),
        _act(node, 0x16, 0x1B, "", Effect.MOTION, 2),
        _act(node, 0x16, 0x2C, "", Effect.MOTION, 1)._replace(from_one=True),
    ]


_BOLT_DRIVE = [
    _act(2, 0x16, 0x0C, "set_stabilization", Effect.MOTION, 1),
    _act(2, 0x16, 0x0F, "set_pitch_torque_modification_value", Effect.WRITE, 1),
]


def _sensors(node: int) -> list[Row]:
    return [
        _idle(node, 0x18, 0x0F, "enable_gyro_max_notify", 1),
        _act(node, 0x18, 0x13, "reset_locator_x_and_y", Effect.WRITE, 0),
        _act(node, 0x18, 0x17, "set_locator_flags", Effect.WRITE, 1)._replace(limit=3),
        _act(node, 0x18, 0x1E, "", Effect.WRITE, 2),
        _read(node, 0x18, 0x20, "", b"\x05", 1),
    ]


def _masks(node: int) -> list[Row]:
    return [
        _act(node, 0x18, 0x00, "set_sensor_streaming_mask", Effect.WRITE, 7),
        _read(node, 0x18, 0x01, "get_sensor_streaming_mask", bytes(7)),
        _read(node, 0x18, 0x0D, "get_extended_sensor_streaming_mask", bytes(4)),
    ]


BOLT: tuple[Row, ...] = (
    *_api(1),
    *_api(2),
    *_SYSTEM,
    *_POWER,
    *_BOLT_POWER,
    *_NAMES,
    *_BOLT_LEDS,
    *_drive(2),
    *_BOLT_DRIVE,
    *_sensors(2),
    *_masks(2),
    _read(2, 0x18, 0x30, "get_ambient_light_sensor_value", b"\x42\x28\x00\x00"),
)
"""Two nodes; the drive has no read that could tell how it treats lengths."""

RVR: tuple[Row, ...] = (
    *_api(1),
    *_api(2),
    *(_read(node, 0x10, 0x09, "generate_api_error", b"", 1) for node in (1, 2)),
    *_SYSTEM,
    *_POWER,
    _read(1, 0x13, 0x10, "get_battery_percentage", b"\x4b"),
    *_NAMES,
    _idle(1, 0x1A, 0x1A, "set_all_leds_with_32_bit_mask", 4, 36),
    _act(1, 0x1A, 0x27, "", Effect.WRITE, 3),
    *_drive(2),
    _read(2, 0x16, 0x29, "get_motor_fault_state", b"\x00"),
    _read(2, 0x16, 0x3D, "get_drive_target_slew_parameters", bytes(17)),
    _idle(2, 0x16, 0x25, "enable_motor_stall_notify", 1),
    *_sensors(2),
    _read(2, 0x18, 0x22, "get_bot_to_bot_infrared_readings", bytes(4)),
)
"""Two nodes; answers with an error code on demand, and its drive has reads."""

R2: tuple[Row, ...] = (
    *_api(1),
    *_SYSTEM,
    *_POWER,
    _read(1, 0x13, 0x03, "get_battery_voltage", b"\x01\x90"),
    *_NAMES,
    *_drive(1),
    _act(1, 0x17, 0x05, "play_animation", Effect.MOTION, 2),
    _act(1, 0x17, 0x0D, "perform_leg_action", Effect.MOTION, 1),
    _act(1, 0x17, 0x0F, "set_head_position", Effect.MOTION, 4),
    _read(1, 0x17, 0x14, "get_head_position", bytes(4)),
    _read(1, 0x17, 0x16, "get_leg_position", bytes(4)),
    _read(1, 0x17, 0x25, "get_leg_action", b"\x00"),
    _idle(1, 0x17, 0x2A, "enable_leg_action_notify", 1),
    _act(1, 0x17, 0x2B, "stop_animation", Effect.MOTION, 0),
    _act(1, 0x17, 0x2D, "enable_trophy_mode", Effect.PERSIST, 1),
    _act(1, 0x17, 0x31, "", Effect.MOTION, 1),
    *_sensors(1),
    *_masks(1),
    _act(1, 0x1A, 0x07, "play_audio_file", Effect.MOTION, 3),
    _act(1, 0x1A, 0x08, "set_audio_volume", Effect.MOTION, 1),
    _read(1, 0x1A, 0x09, "get_audio_volume", b"\x20"),
    _act(1, 0x1A, 0x0A, "stop_all_audio", Effect.WRITE, 0),
    _idle(1, 0x1A, 0x0E, "set_all_leds_with_16_bit_mask", 2, 18),
    _act(1, 0x1A, 0x27, "", Effect.WRITE, 3),
)
"""One node that does everything; it walks."""

BB8: tuple[Row, ...] = (
    _read(1, 0x00, 0x01, "ping", b""),
    _read(1, 0x00, 0x02, "get_versions", bytes.fromhex("0203010a011433aa")),
    _act(1, 0x00, 0x10, "set_bluetooth_name", Effect.PERSIST, 1, 48),
    _read(1, 0x00, 0x11, "get_bluetooth_info", b"Stranger".ljust(32, b"\x00")),
    _read(1, 0x00, 0x20, "get_power_state", bytes.fromhex("0102030400050006")),
    _idle(1, 0x00, 0x21, "enable_battery_state_changed_notify", 1),
    _act(1, 0x00, 0x22, "sleep", Effect.MOTION, 5),
    _read(1, 0x00, 0x23, "get_voltage_trip_points", bytes(4)),
    _act(1, 0x00, 0x30, "jump_to_bootloader", Effect.BRICK, 0),
    _act(1, 0x02, 0x01, "set_heading", Effect.MOTION, 2),
    _act(1, 0x02, 0x03, "set_rotation_rate", Effect.WRITE, 1),
    _read(1, 0x02, 0x07, "get_chassis_id", b"\x12\x34"),
    _read(1, 0x02, 0x15, "read_locator", bytes(10)),
    _act(1, 0x02, 0x20, "set_main_led", Effect.WRITE, 3, 4),
    _read(1, 0x02, 0x22, "get_main_led", bytes(3)),
    _act(1, 0x02, 0x30, "roll", Effect.MOTION, 4),
    _act(1, 0x02, 0x33, "set_raw_motors", Effect.MOTION, 4),
    _act(1, 0x02, 0x3B, "", Effect.MOTION, 1),
)
"""The older protocol."""
