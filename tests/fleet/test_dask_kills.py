"""Workers, clients and schedulers that are killed in the middle of runs."""

import asyncio
import json
import random
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from contextlib import aclosing, closing
from pathlib import Path

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.fleet.on_robot import FleetConsent, RobotOptions
from sphero_probe.fleet.plans import PlanAction, Subject
from sphero_probe.fleet.records import Status
from sphero_probe.fleet.robots import FleetRobot, fleet_of
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.runs.interrupted import InterruptedRun
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.resume import RunJournal
from tests.support.dask import Workers, said, scheduler, until, workers
from tests.support.fleet import Records, ended, findings_of, on_fleet
from tests.support.virtual_clock import run

pytest.importorskip("distributed", reason="the extra dask is not installed")
pytestmark = [pytest.mark.slow, pytest.mark.unmeasured]

KILLS = 6
NOT_AGAIN = "not sent again"


def plan_for(_: Subject) -> tuple[Plan, dict[str, str]]:
    return Plan("sweep", "", [list(sweep([0x13, 0x1A], range(0x40)))]), {"did": "0x13,0x1a"}


SWEEP = PlanAction("sweep", plan_for)


def devices_in(folder: Path, kind: str) -> list[str]:
    """Ten robots; each writes what it executes to a file that grows on whichever worker reaches it."""
    return [
        f"fake:bolt-plus?seed={seed}&latency=15ms&interval=30ms&ledger={folder}/{kind}{seed}"
        for seed in range(10)
    ]


def executed(folder: Path, kind: str) -> list[Counter[str]]:
    """For each robot, how often it executed what is more than a read."""
    return [
        Counter(line for line in lines if json.loads(line)["risk"] != "read")
        for seed in range(10)
        for lines in [(folder / f"{kind}{seed}").read_text().splitlines()]
    ]


async def kill_some(started: Workers, journals: Iterable[Path], settled: list[dict[int, Finding]]) -> None:
    """Kill workers at random moments, and note what the journals hold each time."""
    chance = random.Random(7)
    await until(lambda: all(journal.exists() and journal.stat().st_size for journal in journals))
    for _ in range(KILLS):
        await asyncio.sleep(chance.uniform(0.1, 0.7))
        started.kill(chance.choice(started.running))
        for known, journal in zip(settled, journals, strict=True):
            with closing(InterruptedRun(journal.open("rb"), journal)) as interrupted:
                known.update(interrupted.earlier.findings)
        started.start()


def test_killed_workers_lose_nothing_that_was_answered_and_nothing_above_probe_is_sent_twice(
    tmp_path: Path,
) -> None:
    from sphero_probe.fleet.dask.client import DaskFleet

    options = RobotOptions(FleetConsent(frozenset({Risk.READ, Risk.PROBE, Risk.WRITE, Risk.PERSIST})))
    single = run(on_fleet(devices_in(tmp_path, "alone"), SWEEP, options=options))
    devices = devices_in(tmp_path, "dask")
    journals = [tmp_path / f"{seed}.jsonl" for seed in range(10)]
    settled: list[dict[int, Finding]] = [{} for _ in devices]
    records: Records = {device: [] for device in devices}

    def journal_for(robot: FleetRobot) -> RunJournal:
        return RunJournal("sweep", file=str(journals[devices.index(robot.device)]))

    async def work() -> None:
        async with scheduler() as address:
            with workers(address, devices, 2) as started:
                fleet = DaskFleet(
                    *(fleet_of(devices), SWEEP, journal_for), scheduler=address, options=options
                )
                killing = asyncio.create_task(kill_some(started, journals, settled))
                async with aclosing(fleet.records()) as told:
                    async for robot, record in told:
                        records[robot.device].append(record)
                assert killing.done()
                killing.result()

    asyncio.run(work())
    alone = list(single.values())
    for number, device in enumerate(devices):
        assert ended(records[device]).status is Status.DONE
        found, expected = findings_of(records[device]), findings_of(alone[number])
        assert len(found) == len(expected)
        unknown = {finding.number for finding in found if NOT_AGAIN in finding.note}
        kept = [  # a read may tell that another worker's robot has not been written to
            pair
            for pair in zip(said(found), said(expected), strict=True)
            if pair[0][0] not in unknown and pair[0][4] is not Risk.READ
        ]
        assert all(now == then for now, then in kept)
        assert len(unknown) <= KILLS  # at most the one that was in flight
        journal = read_journal(journals[number])
        answered = [one for one in settled[number].values() if isinstance(one.exchange, Answered)]
        assert said([journal.findings[one.number] for one in answered]) == said(answered)
    for counts in executed(tmp_path, "dask"):
        assert not [command for command, times in counts.items() if times > 1]


def test_no_orphan_goes_on_sending(tmp_path: Path) -> None:
    ledger, contact = tmp_path / "ledger", tmp_path / "scheduler"
    device = f"fake:bolt-plus?seed=3&latency=50ms&interval=100ms&ledger={ledger}"
    command = [sys.executable, "-m", "sphero_probe", "fleet"]
    serving = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    serving += ["--scheduler-file", str(contact), "--dashboard-address", "127.0.0.1:0"]
    started = [subprocess.Popen(serving, stderr=subprocess.DEVNULL)]
    try:
        asyncio.run(until(lambda: contact.exists() and contact.stat().st_size > 0))
        place = ["--scheduler", json.loads(contact.read_text())["address"]]
        sweeping = [*command, "sweep", "--did", "0x13", *place, "--no-journal", "-d"]
        started += [
            subprocess.Popen([*command, "worker", *place, "-d", device]),
            subprocess.Popen([*sweeping, "BP-0000"], stdout=subprocess.DEVNULL),  # which no worker reaches
            subprocess.Popen([*sweeping, device], stdout=subprocess.DEVNULL),
        ]
        scheduler, worker, waiting, client = started
        asyncio.run(until(lambda: ledger.exists() and ledger.read_bytes().count(b"\n") > 20))
        client.kill()
        asyncio.run(asyncio.sleep(1))
        then = ledger.stat().st_size
        asyncio.run(asyncio.sleep(1))  # time for a dozen commands
        assert ledger.stat().st_size == then
        assert worker.poll() is None
        scheduler.kill()
        assert (worker.wait(timeout=15), waiting.wait(timeout=15)) == (4, 5)
    finally:
        for process in started:
            process.kill()
            process.wait()
