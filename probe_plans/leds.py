"""Which LED commands exist: the widths of the LED mask, and animations, all of device 0x1A.

Nothing lights up: setters are sent at a length that they do not accept. ``sphero-probe led`` sets LEDs.
"""

from sphero_probe import Command, Plan, Probe

MASKS = (0x0E, 0x1A, 0x1B, 0x1C)  # 16, 32, 64 and 8 bit
ANIMATIONS = (0x04, 0x19, 0x2F, 0x4E)

PLAN = Plan(
    name="leds",
    summary="which LED commands exist, without lighting one",
    stages=[
        [Probe(Command(0x1A, cid)) for cid in MASKS],
        [Probe(Command(0x1A, cid)) for cid in ANIMATIONS],
    ],
)
