"""The core of a first-generation robot: device 0x00, with names, power, Bluetooth and diagnostics.

The plan sends nothing to the bootloader, device 0x01.
"""

from sphero_probe import Plan, sweep

PLAN = Plan(
    name="v1_core",
    summary="device 0x00 of a first-generation robot: versions, power, Bluetooth",
    robots=("sphero", "sprk", "sprk-plus", "ollie", "bb8"),
    stages=[list(sweep([0x00], range(0x60)))],
)
