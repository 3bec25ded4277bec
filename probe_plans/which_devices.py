"""Which devices exist: each of the 256 DIDs is asked for a command that no device is known to have."""

from sphero_probe import Plan, sweep

UNLIKELY = 0xFD

PLAN = Plan(
    name="which_devices",
    summary="which of the 256 device ids exist: 0x01 means no such device, 0x02 that it is there",
    stages=[list(sweep(range(256), [UNLIKELY]))],
)
