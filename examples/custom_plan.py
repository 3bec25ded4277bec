"""Run a plan with two stages, built in code: the second one depends on the findings of the first."""

import asyncio
import sys
from collections.abc import Iterator, Sequence

from sphero_probe import Command, Finding, Outcome, Plan, Probe, connect, sweep

BATTERY = Probe(Command(0x13, 0x10))


def neighbours(findings: Sequence[Finding]) -> Iterator[Probe]:
    """Probe the ids next to every command that exists."""
    for finding in findings:
        if finding.outcome is Outcome.EXISTS:
            did, cid, *_ = finding.command
            yield from sweep([did], range(max(cid - 3, 0), cid + 4))


async def main(device: str = "fake:bolt-plus") -> None:
    plan = Plan(
        "around_the_battery", "the commands next to battery percentage", stages=[[BATTERY], neighbours]
    )
    async with connect(device) as robot:
        run = await robot.run(plan).collect()
    for finding in run.existing:
        print(finding.number, finding.name, finding.code_name)


asyncio.run(main(*sys.argv[1:]))
