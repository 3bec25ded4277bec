"""Switch on the accelerometer stream of a V2 robot and print it for a while."""

import asyncio
import sys

import sphero_probe

EVERY_50_MS_THE_ACCELEROMETER = bytes.fromhex("0032 00 0000e000")


async def main(device: str = "fake:bolt", seconds: str = "0.5") -> None:
    async with sphero_probe.connect(device, consent=["write"]) as robot:
        received = robot.notifications(seconds=float(seconds))
        await robot.send("sensor.set_sensor_streaming_mask", payload=EVERY_50_MS_THE_ACCELEROMETER)
        async for notification in received:
            print(notification.name, dict(notification.fields))
        await robot.send("sensor.set_sensor_streaming_mask", payload=bytes(7))
        if received.dropped:
            print(f"{received.dropped} notifications were dropped: printing was too slow", file=sys.stderr)


asyncio.run(main(*sys.argv[1:]))
