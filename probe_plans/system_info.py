"""Versions, addresses and configuration: device 0x11. Unknown ids next to its writes are skipped."""

from sphero_probe import Plan, sweep

PLAN = Plan(
    name="system_info",
    summary="versions, addresses, configuration: every command of device 0x11",
    stages=[list(sweep([0x11], range(0x50)))],
)
