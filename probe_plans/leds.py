"""Which lamp commands exist: the widths of the LED mask, and others of device 0x1A.

Nothing lights up: a setter is asked at a length that it does not take. ``sphero-probe led`` lights lamps.
"""

from sphero_probe import Command, Plan, Probe

MASKS = (0x0E, 0x1A, 0x1B, 0x1C)  # 16, 32, 64 and 8 bit
ANIMATIONS = (0x04, 0x19, 0x2F, 0x4E)

PLAN = Plan(
    name="leds",
    summary="which lamp commands exist, without lighting one",
    stages=[
        [Probe(Command(0x1A, cid)) for cid in MASKS],
        [Probe(Command(0x1A, cid)) for cid in ANIMATIONS],
    ],
)
