"""The policy blocks a command that moves the robot, until consent allows it."""

import asyncio
import sys

from sphero_probe import connect
from sphero_probe.errors import RefusedByPolicyError

FORWARD_SLOWLY = bytes.fromhex("01 30 01 30")  # left motor forward at 0x30, right motor likewise


async def main(device: str = "fake:rvr", seconds: str = "0.2") -> None:
    async with connect(device) as robot:
        try:
            await robot.send("drive.set_raw_motors", payload=FORWARD_SLOWLY)
        except RefusedByPolicyError as error:
            print(f"{error}; {error.hint}")
    async with connect(device, consent=["motion"]) as robot:  # leaving the block stops the motors
        answer = await robot.send("drive.set_raw_motors", payload=FORWARD_SLOWLY)
        print(answer)
        await asyncio.sleep(float(seconds))


asyncio.run(main(*sys.argv[1:]))
