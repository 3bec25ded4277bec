"""Say hello: wake the robot, hear an echo, ask who it is. The shortest plan, and a template for yours."""

from sphero_probe import Command, Plan, Probe

PLAN = Plan(
    name="hello",
    summary="wake, echo, and who are you",
    stages=[
        [
            Probe(Command(0x13, 0x0D)),  # power.wake
            Probe(Command(0x10, 0x00, b"hello")),  # the robot sends the same bytes back
            Probe(Command(0x11, 0x00)),  # firmware version
            Probe(Command(0x13, 0x10)),  # battery percentage
        ]
    ],
)
