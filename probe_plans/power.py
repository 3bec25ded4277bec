"""Everything about the battery: device 0x13 from end to end, documented or not."""

from sphero_probe import Plan, sweep

PLAN = Plan(
    name="power",
    summary="battery, charger and sleep: every command of device 0x13",
    stages=[list(sweep([0x13], range(0x40)))],
)
