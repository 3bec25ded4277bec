"""Every command in the BOLT+ reference, and the matrix commands of the BOLT on both nodes.

The BOLT+ has no node 0x12, so a matrix command sent there should fail with 0x09, bad target id. Nothing moves
or lights up: setters are sent at a length that they do not accept.
"""

from sphero_probe import Command, Plan, Probe

PRIMARY, SECONDARY = 0x11, 0x12

READS = [
    (0x11, 0x00),  # main application version
    (0x11, 0x03),  # board revision
    (0x13, 0x03),  # battery voltage
    (0x13, 0x10),  # battery percentage
]
MOTORS = [
    (0x16, 0x01),  # raw motors
    (0x16, 0x07),  # drive with heading
]
LEDS = Command(0x1A, 0x1C, b"", PRIMARY)  # front and back, 8-bit mask
MATRIX = [0x2F, 0x2D, 0x3B, 0x42, 0x3E, 0x3D]  # one colour, pixel, text, character, fill, line

PLAN = Plan(
    name="bolt_plus",
    summary="every command in the BOLT+ reference, matrix commands on both nodes",
    robots=("bolt-plus",),
    stages=[
        [Probe(Command(did, cid, b"", PRIMARY)) for did, cid in READS],
        [Probe(Command(did, cid, b"", PRIMARY)) for did, cid in MOTORS],
        [Probe(LEDS)],
        [Probe(Command(0x1A, cid, b"", node)) for node in (PRIMARY, SECONDARY) for cid in MATRIX],
    ],
)
