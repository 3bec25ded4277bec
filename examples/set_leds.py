"""Show the colours of the rainbow on every LED of a robot, then switch them off."""

import asyncio
import colorsys
import sys

import sphero_probe


def rainbow(steps: int) -> list[tuple[int, int, int]]:
    colors = (colorsys.hsv_to_rgb(step / steps, 1, 1) for step in range(steps))
    return [(int(255 * red), int(255 * green), int(255 * blue)) for red, green, blue in colors]


async def main(device: str = "fake:rvr", steps: str = "6") -> None:
    async with sphero_probe.connect(device) as robot:  # LEDs need no consent
        print(f"{robot.name} has the LEDs {', '.join(robot.leds)}")
        for color in rainbow(int(steps)):
            await robot.set_leds(dict.fromkeys(robot.leds, color))
        await robot.set_leds({}, off=True)


asyncio.run(main(*sys.argv[1:]))
