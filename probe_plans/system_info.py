"""What the robot knows about itself: device 0x11; unknown neighbours of its config writes are skipped."""

from sphero_probe import Plan, sweep

PLAN = Plan(
    name="system_info",
    summary="versions, addresses, configuration: every command of device 0x11",
    stages=[list(sweep([0x11], range(0x50)))],
)
