"""What a first-generation robot can do: device 0x02, with lamps, driving, sensors, macros and orbBasic.

Nothing moves or lights up: what is no read is asked at a length that it does not take.
"""

from sphero_probe import Plan, sweep

PLAN = Plan(
    name="v1_robot",
    summary="device 0x02 of a first-generation robot: lamps, driving, sensors",
    robots=("sphero", "sprk", "sprk-plus", "ollie", "bb8"),
    stages=[list(sweep([0x02], range(0x80)))],
)
