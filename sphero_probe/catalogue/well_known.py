"""The commands that the tool itself needs, such as wake, echo and stop, for each generation."""

from enum import StrEnum
from typing import Final

from sphero_probe.catalogue.commands import row_by_name
from sphero_probe.catalogue.model import CommandRow
from sphero_probe.protocol.packets import Generation


class WellKnown(StrEnum):
    """Tasks that every robot can do in some way."""

    WAKE = "wake"
    ECHO = "echo"
    """Harmless, and its response is known: the robot sends the arguments back."""
    VERSION = "version"
    ERROR_ON_DEMAND = "error on demand"
    """Responds with the error code that it is given, which shows that codes are decoded correctly."""
    CLAIMED_DEVICES = "claimed devices"
    """Lists the device ids that the robot claims to have; evidence, not proof."""
    CLAIMED_COMMANDS = "claimed commands"
    """Lists the command ids that the robot claims for one device; takes the device id."""
    STOP = "stop"
    """Motors off: the arguments are zeros."""


_JOBS: Final[dict[Generation, dict[WellKnown, str]]] = {
    Generation.V1: {  # a sleeping V1 robot is woken through a GATT characteristic, not by a command
        WellKnown.ECHO: "core.ping",
        WellKnown.VERSION: "core.get_versions",
        WellKnown.STOP: "sphero.roll",
    },
    Generation.V2: {
        WellKnown.WAKE: "power.wake",
        WellKnown.ECHO: "api_and_shell.ping",
        WellKnown.VERSION: "system_info.get_main_app_version",
        WellKnown.ERROR_ON_DEMAND: "api_and_shell.generate_api_error",
        WellKnown.CLAIMED_DEVICES: "api_and_shell.get_supported_dids",
        WellKnown.CLAIMED_COMMANDS: "api_and_shell.get_supported_cids",
        WellKnown.STOP: "drive.set_raw_motors",
    },
}

FACTS: Final[dict[Generation, tuple[str, ...]]] = {
    Generation.V1: (
        "core.get_versions",
        "core.get_bluetooth_info",
        "core.get_power_state",
        "core.get_charger_state",
        "sphero.get_sku",
        "sphero.get_chassis_id",
        "sphero.get_device_mode",
    ),
    Generation.V2: (
        "system_info.get_main_app_version",
        "system_info.get_bootloader_version",
        "system_info.get_processor_name",
        "system_info.get_board_revision",
        "system_info.get_model_number",
        "system_info.get_sku",
        "system_info.get_three_character_sku",
        "system_info.get_mac_address",
        "system_info.get_stats_id",
        "system_info.get_manufacturing_date",
        "system_info.get_core_up_time_in_milliseconds",
        "connection.get_bluetooth_name",
        "power.get_battery_percentage",
        "power.get_battery_voltage",
        "power.get_battery_voltage_state",
        "power.get_charger_state",
    ),
}
"""The documented reads that describe a robot, in the order in which reports show them."""


VERSION_FIELDS: Final[dict[Generation, tuple[str, ...]]] = {
    Generation.V1: ("main_app_major", "main_app_minor"),
    Generation.V2: ("major", "minor", "revision"),
}
"""The fields of the version answer that make up the firmware's version, joined by dots."""


def row_for(generation: Generation, job: WellKnown) -> CommandRow | None:
    """Return the row of the command for a task, None where the generation has none."""
    name = _JOBS[generation].get(job)
    return row_by_name(generation, name) if name else None
