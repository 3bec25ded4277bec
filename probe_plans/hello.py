"""Wake the robot, send an echo, read the firmware version and the battery. A template for your own plan."""

from sphero_probe import Command, Plan, Probe

PLAN = Plan(
    name="hello",
    summary="wake the robot, echo, firmware version, battery",
    stages=[
        [
            Probe(Command(0x13, 0x0D)),  # power.wake
            Probe(Command(0x10, 0x00, b"hello")),  # the robot sends the same bytes back
            Probe(Command(0x11, 0x00)),  # firmware version
            Probe(Command(0x13, 0x10)),  # battery percentage
        ]
    ],
)
