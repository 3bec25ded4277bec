"""Check before a lesson that all robots are reachable; print firmware and battery, one line per robot."""

import asyncio
import sys

import sphero_probe


async def check(device: str) -> str:
    try:
        async with sphero_probe.connect(device) as robot:
            firmware = await robot.firmware()
            battery = await robot.send("power.get_battery_voltage", check=False)
            await robot.set_leds(dict.fromkeys(robot.leds[:1], "00ff00"))
            return f"ok    {robot.name}: firmware {firmware}, {battery.fields.get('voltage', 'unknown')} V"
    except sphero_probe.errors.SpheroProbeError as error:
        return f"FAIL  {device}: {error} ({error.hint})"


async def main(devices: list[str]) -> None:
    for line in await asyncio.gather(*map(check, devices)):
        print(line)


asyncio.run(main(sys.argv[1:] or ["fake:bolt", "fake:mini", "fake:rvr"]))
