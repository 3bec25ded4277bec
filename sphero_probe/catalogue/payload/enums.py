"""The named values in payloads: converts numbers and sets of flags to names, and back."""

from typing import NamedTuple


class ValueNames(NamedTuple):
    """The named values of one field.

    Attributes:
        names: number (or single bit) -> name in lower case.
        flags: the numbers are bits of a mask and may be set together.
    """

    names: dict[int, str]
    flags: bool

    def words(self, number: int) -> object:
        """Name a number; an unlisted one stays a number.

        Flags give a list, the unnamed bits as one number at its end.
        """
        if not self.flags:
            return self.names.get(number, number)
        unnamed = number & ~sum(self.names)
        listed: list[object] = [name for bit, name in self.names.items() if number & bit]
        return [*listed, unnamed] if unnamed else listed

    def number(self, words: object) -> int:
        """Return the number of a result of ``words``; a plain number stays as it is.

        Raises:
            ValueError: a name is not listed.
        """
        if isinstance(words, int):
            return words
        if self.flags and isinstance(words, list):
            return sum({self._one(word) for word in words})
        return self._one(words)

    def _one(self, word: object) -> int:
        if isinstance(word, int):
            return word
        for number, name in self.names.items():
            if name == word:
                return number
        raise ValueError(f"{word!r} is none of {', '.join(self.names.values())}")


def _numbers(names: dict[int, str]) -> ValueNames:
    return ValueNames(names, flags=False)


def _flags(names: dict[int, str]) -> ValueNames:
    return ValueNames(names, flags=True)


VALUE_NAMES: dict[str, ValueNames] = {
    "BootReasons": _numbers(
        {
            0: "cold_boot",
            1: "unexpected_reset",
            2: "application_reset_due_to_error",
            3: "application_reset_for_a_firmware_update",
            4: "processor_is_booting_from_sleep",
            5: "processor_is_resetting_for_some_non_error_reason",
        }
    ),
    "SosMessages": _numbers({0: "unknown", 1: "subprocessor_crashed"}),
    "BatteryStates": _numbers(
        {0: "charged", 1: "charging", 2: "not_charging", 3: "ok", 4: "low", 5: "critical", 255: "unknown"}
    ),
    "BatteryVoltageAndStateStates": _numbers(
        {
            0: "charged",
            1: "charging",
            2: "not_charging",
            3: "ok",
            4: "low",
            5: "critical",
            6: "reserved",
            7: "unused",
        }
    ),
    "BatteryVoltageStates": _numbers({0: "unknown", 1: "ok", 2: "low", 3: "critical"}),
    "BatteryVoltageReadingTypes": _numbers(
        {0: "calibrated_and_filtered", 1: "calibrated_and_unfiltered", 2: "uncalibrated_and_unfiltered"}
    ),
    "ChargerStates": _numbers({0: "unknown", 1: "not_charging", 2: "charging", 3: "charged"}),
    "AmplifierIds": _numbers({0: "left_motor", 1: "right_motor"}),
    "EfuseIds": _numbers({0: "primary_efuse"}),
    "DriveFlags": _flags(
        {
            0x01: "backward",
            0x02: "turbo",
            0x04: "fast_turn",
            0x08: "left_direction",
            0x10: "right_direction",
            0x20: "enable_drift",
        }
    ),
    "RawMotorModes": _numbers({0: "off", 1: "forward", 2: "reverse"}),
    "GenericRawMotorIndexes": _numbers({0: "left_drive", 1: "right_drive", 2: "head", 3: "leg"}),
    "GenericRawMotorModes": _numbers({0: "motor_off", 1: "forward", 2: "reverse"}),
    "StabilizationIndexes": _numbers(
        {
            0: "no_control_system",
            1: "full_control_system",
            2: "pitch_control_system",
            3: "roll_control_system",
            4: "yaw_control_system",
            5: "speed_and_yaw_control_system",
        }
    ),
    "MotorIndexes": _numbers({0: "left_motor", 1: "right_motor"}),
    "LinearVelocitySlewMethods": _numbers({0: "constant", 1: "proportional"}),
    "RCDriveFlags": _flags({0x01: "slew_linear_velocity"}),
    "XYPositionDriveFlags": _flags({0x01: "force_reverse", 0x02: "auto_reverse"}),
    "R2DoLegActions": _numbers(
        {0: "unknown", 1: "three_legs", 2: "two_legs", 3: "waddle", 4: "transitioning"}
    ),
    "R2LegActions": _numbers({0: "stop", 1: "three_legs", 2: "two_legs", 3: "waddle"}),
    "GyroMaxFlags": _flags(
        {
            0x01: "max_plus_x",
            0x02: "max_minus_x",
            0x04: "max_plus_y",
            0x08: "max_minus_y",
            0x10: "max_plus_z",
            0x20: "max_minus_z",
        }
    ),
    "CollisionDetectedAxis": _flags({0x01: "x_axis", 0x02: "y_axis"}),
    "CollisionDetectionMethods": _numbers(
        {
            0: "no_collision_detection",
            1: "accelerometer_based_detection",
            2: "accelerometer_based_with_extra_filtering",
            3: "hybrid_accelerometer_and_control_system_detection",
        }
    ),
    "LocatorFlags": _flags({0x01: "auto_calibrate"}),
    "SensitivityBasedCollisionDetectionMethods": _numbers({0: "accelerometer_based_detection"}),
    "SensitivityLevels": _numbers(
        {0: "super_high", 1: "very_high", 2: "high", 3: "medium", 4: "low", 5: "very_low"}
    ),
    "ThermalProtectionStatus": _numbers({0: "ok", 1: "warn", 2: "critical"}),
    "AudioPlaybackModes": _numbers(
        {0: "play_immediately", 1: "play_only_if_not_playing", 2: "play_after_current_sound"}
    ),
    "FadeOverrideOptions": _numbers({0: "none", 1: "no_fading", 2: "fading_animations"}),
    "FrameInfoTypes": _numbers({0: "8_bit", 1: "16_bit", 2: "32_bit", 3: "64_bit"}),
    "FrameRotationOptions": _numbers(
        {0: "normal", 1: "rotate_90_degrees", 2: "rotate_180_degrees", 3: "rotate_270_degrees"}
    ),
    "TextScrollingReasonCodes": _numbers({0: "done", 1: "looping"}),
    "ColorPaletteIndexes": _numbers({0: "default", 1: "midi"}),
    "ApplicationIds": _numbers({0: "bootloader", 1: "main_app"}),
    "PendingUpdateFlags": _flags(
        {
            0x01: "nordic",
            0x02: "st",
            0x04: "esp2886",
            0x08: "audio",
            0x10: "animations",
            0x20: "st_bootloader",
        }
    ),
    "ResetStrategies": _numbers({1: "reset_into_or_jump_to_main_app", 2: "reset_into_or_jump_to_bootloader"}),
    "PowerStates": _numbers({0: "unknown", 1: "charging", 2: "ok", 3: "low", 4: "critical"}),
    "ChargerContacts": _numbers({0: "unknown", 1: "out_of_charger", 2: "in_charger"}),
    "SelfLevelOptions": _flags(
        {0x01: "start", 0x02: "keep_heading", 0x04: "sleep_after", 0x08: "turn_control_system_on"}
    ),
    "SelfLevelResults": _numbers(
        {
            0: "unknown",
            1: "timed_out",
            2: "sensor_error",
            3: "disabled",
            4: "aborted",
            5: "charger_not_found",
            6: "success",
        }
    ),
    "AccelerometerRanges": _numbers({0: "2_g", 1: "4_g", 2: "8_g", 3: "16_g"}),
    "RollModes": _numbers({0: "stop", 1: "go", 2: "calibrate"}),
    "SpheroRawMotorModes": _numbers({0: "off", 1: "forward", 2: "reverse", 3: "brake", 4: "ignore"}),
    "PersistentOptions": _flags(
        {
            0x001: "disable_sleep_in_charger",
            0x002: "enable_vector_drive",
            0x004: "disable_self_level_in_charger",
            0x008: "enable_tail_light_always_on",
            0x010: "enable_motion_timeout",
            0x020: "enable_retail_demo",
            0x040: "awake_on_light_double_tap",
            0x080: "awake_on_heavy_double_tap",
            0x100: "enable_gyro_max_notify",
            0x400: "enable_full_speed",
        }
    ),
    "TemporaryOptions": _flags({0x01: "enable_stop_on_disconnect"}),
    "ConfigBlocks": _numbers({0: "factory", 1: "user"}),
    "DeviceModes": _numbers({0: "normal", 1: "hack"}),
    "SoulBanks": _numbers({0: "boost", 1: "shield"}),
    "SoulAttributes": _numbers({0: "speed", 1: "boost", 2: "brightness", 3: "shield"}),
    "ProgramAreas": _numbers({0: "ram", 1: "flash"}),
}
"""Every set of value names that a layout may mention in braces."""
