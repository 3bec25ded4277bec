"""Battery, charger and sleep: the first 64 commands of device 0x13, documented or not."""

from sphero_probe import Plan, sweep

PLAN = Plan(
    name="power",
    summary="battery, charger and sleep: commands 0x00-0x3f of device 0x13",
    stages=[list(sweep([0x13], range(0x40)))],
)
