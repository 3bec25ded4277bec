"""Device 0x02 of a first-generation robot: LEDs, driving, sensors, macros and orbBasic.

Nothing moves or lights up: commands other than reads are sent at a length that they do not accept.
"""

from sphero_probe import Plan, sweep

PLAN = Plan(
    name="v1_robot",
    summary="device 0x02 of a first-generation robot: LEDs, driving, sensors",
    robots=("sphero", "sprk", "sprk-plus", "ollie", "bb8"),
    stages=[list(sweep([0x02], range(0x80)))],
)
