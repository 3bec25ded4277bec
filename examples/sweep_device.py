"""Print every command of one device that exists: python examples/sweep_device.py [ADDRESS [DEVICE]]."""

import asyncio
import sys

import sphero_probe


async def main(device: str = "fake:bolt-plus", did: str = "power") -> None:
    async with sphero_probe.connect(device) as robot:
        async for finding in robot.sweep(did=did):
            if finding.outcome is sphero_probe.Outcome.EXISTS:
                command = finding.command
                print(
                    f"0x{command.did:02x}:0x{command.cid:02x}  {finding.name or 'in no catalogue'}",
                    finding.fields,
                )


asyncio.run(main(*sys.argv[1:]))
