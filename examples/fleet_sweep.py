"""Sweep several robots at once, and print the commands that only some of them have."""

import asyncio
import sys

import sphero_probe


async def main(devices: list[str]) -> None:
    run = sphero_probe.Fleet(devices).sweep(did="power")
    having: dict[str, set[str]] = {}
    async for robot, finding in run:
        if finding.outcome is sphero_probe.Outcome.EXISTS:
            did, cid = finding.command[:2]
            having.setdefault(f"0x{did:02x}:0x{cid:02x}", set()).add(robot.name)
    for result in run.results.values():
        ended = result.ended.trouble or result.ended.status if result.ended else "not started"
        print(f"{result.name}: {result.model}, firmware {result.firmware}: {ended}")
    for pair, robots in sorted(having.items()):
        if len(robots) < len(devices):
            print(f"{pair} only on {', '.join(sorted(robots))}")


asyncio.run(main(sys.argv[1:] or ["fake:bolt", "fake:mini", "fake:rvr"]))
