"""Sweep a device into a journal, and print the journal as CSV."""

import asyncio
import csv
import sys
import tempfile
from pathlib import Path

import sphero_probe


async def sweep_into(journal: Path, device: str) -> None:
    async with sphero_probe.connect(device) as robot:
        await robot.sweep(did="system_info", journal=journal).collect()


def main(device: str = "fake:mini") -> None:
    with tempfile.TemporaryDirectory() as folder:
        journal = Path(folder) / "run.jsonl"
        asyncio.run(sweep_into(journal, device))
        run = sphero_probe.load_run(journal)
    table = csv.writer(sys.stdout)
    table.writerow(["did", "cid", "name", "outcome", "code", "payload"])
    for finding in run.findings:
        did, cid, *_ = finding.command
        table.writerow([did, cid, finding.name, finding.outcome, finding.code, finding.payload.hex()])


main(*sys.argv[1:])
