"""Print the battery of a robot: python examples/battery.py [ADDRESS]."""

import asyncio
import sys

import sphero_probe


async def main(device: str) -> None:
    async with sphero_probe.connect(device) as robot:
        answer = await robot.send("power.get_battery_voltage")
        unit = answer.units["voltage"]
        print(f"{robot.name}: {answer.voltage} {unit}, answered in {1000 * (answer.rtt or 0):.1f} ms")


asyncio.run(main(*sys.argv[1:] or ["fake:bolt-plus"]))
