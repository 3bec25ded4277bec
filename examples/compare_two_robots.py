"""Sweep two robots at the same time and print the commands that only one of them has."""

import asyncio
import sys

import sphero_probe


async def commands_of(device: str) -> set[tuple[int, int]]:
    async with sphero_probe.connect(device) as robot:
        run = await robot.sweep(did="power").collect()
    return {(finding.command.did, finding.command.cid) for finding in run.existing}


async def main(one: str = "fake:bolt-plus", other: str = "fake:rvr") -> None:
    first, second = await asyncio.gather(commands_of(one), commands_of(other))
    for did, cid in sorted(first ^ second):
        print(f"0x{did:02x}:0x{cid:02x} only on {one if (did, cid) in first else other}")


asyncio.run(main(*sys.argv[1:]))
