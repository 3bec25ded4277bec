"""Which devices exist: sends each of the 256 DIDs a command that no device is known to have."""

from sphero_probe import Plan, sweep

UNLIKELY = 0xFD

PLAN = Plan(
    name="which_devices",
    summary="which of the 256 device ids exist: code 0x01 means no such device, 0x02 that it exists",
    stages=[list(sweep(range(256), [UNLIKELY]))],
)
