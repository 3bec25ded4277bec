"""Fleets on the workers of a Dask scheduler: as on one host, whatever happens to workers and clients."""

import asyncio
import json
from collections.abc import Callable
from contextlib import aclosing
from pathlib import Path

import pytest

from sphero_probe.catalogue.risk import Risk
from sphero_probe.fleet.action import Action
from sphero_probe.fleet.lights import LedAction, colours_of
from sphero_probe.fleet.on_robot import FleetConsent, RobotOptions
from sphero_probe.fleet.plans import PlanAction, Subject
from sphero_probe.fleet.records import Ended, FleetRecord, Reached, Status
from sphero_probe.fleet.robots import FleetRobot, fleet_of
from sphero_probe.probing.finding import Finding, Heading
from sphero_probe.probing.plan import Plan, sweep
from sphero_probe.runs.reader import read_journal
from sphero_probe.runs.resume import RunJournal
from sphero_probe.simulator import FakeRobot, parse_settings
from tests.support.dask import said, scheduler, serving, until, workers_here
from tests.support.fake_bluez import FakeBlueZ, Peripheral, sphero_v2
from tests.support.fleet import SWEEP, Records, alone, ended, findings_of, without_journal

pytest.importorskip("distributed", reason="the extra dask is not installed")

DEVICES = [f"fake:bolt-plus?seed={seed}" for seed in range(10)]
SLOW_ROBOT = "fake:bolt-plus?seed=3&latency=20ms&interval=30ms"


def api_plan(_: Subject) -> tuple[Plan, dict[str, str]]:
    return Plan("sweep", "", [list(sweep([0x10], range(8)))]), {"did": "0x10", "cid": "0x00-0x07"}


API = PlanAction("sweep", api_plan)


async def on_workers(
    address: str,
    devices: list[str],
    action: Action = SWEEP,
    *,
    journal_for: Callable[[FleetRobot], RunJournal] = without_journal,
    options: RobotOptions | None = None,
    wait: float = 60,
    until: Callable[[FleetRecord], bool] = lambda _: False,
) -> Records:
    """Run an action on workers; it is told to stop where ``until`` says so."""
    from sphero_probe.fleet.dask.client import DaskFleet

    fleet = DaskFleet(
        *(fleet_of(devices), action, journal_for), scheduler=address, wait=wait, options=options
    )
    records: Records = {device: [] for device in devices}
    async with aclosing(fleet.records()) as told:
        async for robot, record in told:
            records[robot.device].append(record)
            if until(record):
                fleet.stop.set()
    return records


def test_ten_robots_on_two_workers_give_what_each_gives_alone(tmp_path: Path) -> None:
    def journal_for(robot: FleetRobot) -> RunJournal:
        return RunJournal("sweep", file=str(tmp_path / f"{DEVICES.index(robot.device)}.jsonl"))

    async def work() -> Records:
        async with scheduler() as address, workers_here(address, DEVICES[:6], DEVICES[4:]):
            return await on_workers(address, DEVICES, journal_for=journal_for)

    records = asyncio.run(work())
    for number, device in enumerate(DEVICES):
        found, trouble = alone(device)
        assert not trouble
        assert said(findings_of(records[device])) == said(findings_of(found)), device
        assert ended(records[device]).status is Status.DONE
        kept = read_journal(tmp_path / f"{number}.jsonl")
        assert kept.complete
        assert said(findings_of(kept.records())) == said(findings_of(found))


def test_a_robot_waits_for_a_worker_and_is_given_up_in_time() -> None:
    async def work() -> tuple[Records, Records]:
        async with serving() as served:
            none = await on_workers(served.address, DEVICES[:1], wait=0.1)
            waiting = asyncio.create_task(on_workers(served.address, DEVICES[:1]))
            await until(lambda: any(task.state == "no-worker" for task in served.tasks.values()))
            async with workers_here(served.address, DEVICES[:1]):
                return none, await waiting

    none, waited = asyncio.run(work())
    trouble = ended(none[DEVICES[0]])
    assert trouble.status is Status.UNREACHABLE
    assert trouble.trouble == f"no worker reaches {DEVICES[0]}; waited 0.1 s"
    assert ended(waited[DEVICES[0]]).status is Status.DONE


def test_a_worker_offers_the_robots_that_it_hears(monkeypatch: pytest.MonkeyPatch) -> None:
    names = ["BP-1234", "BP-5678", "BP-5678"]  # two have the same name, and are told by their addresses

    async def work() -> tuple[list[str], set[str], Records]:
        from sphero_probe.fleet.dask.cluster import offered_by, offered_robots, open_client

        async with scheduler() as address, workers_here(address, []):
            async with open_client(address) as client:
                offered = await offered_by(client)
            return await offered_robots(address), offered, await on_workers(address, ["BP-1234"], API)

    peripherals = [
        Peripheral(
            *(name, f"AA:BB:CC:DD:EE:0{number}"),
            robot=FakeRobot(parse_settings("bolt-plus")),
            services=sphero_v2(gate=False),
        )
        for number, name in enumerate(names)
    ]
    with FakeBlueZ(peripherals) as air:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", air.address)
        robots, offered, records = asyncio.run(work())
    assert robots == ["BP-1234"]
    assert {f"robot:AA:BB:CC:DD:EE:0{number}" for number in range(3)} < offered
    assert ended(records["BP-1234"]).status is Status.DONE


def test_a_worker_of_another_version_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sphero_probe.fleet.dask.client.__version__", "0.0")

    async def work() -> Records:
        async with scheduler() as address, workers_here(address, DEVICES[:1]):
            return await on_workers(address, DEVICES[:1], API)

    end = ended(asyncio.run(work())[DEVICES[0]])
    assert (end.status, "not 0.0" in end.trouble) == (Status.UNREACHABLE, True)
    assert end.hint == "install the same version on every host"


def test_brick_is_confirmed_for_each_robot() -> None:
    async def work() -> tuple[Records, Records]:
        async with scheduler() as address, workers_here(address, DEVICES[:2]):
            met = await on_workers(address, DEVICES[:2], API)
            names = [record.name for told in met.values() for record in told if isinstance(record, Reached)]
            allowed = frozenset({Risk.READ, Risk.PROBE, Risk.BRICK})
            consent = FleetConsent(allowed, frozenset({names[0]}))
            return met, await on_workers(address, DEVICES[:2], API, options=RobotOptions(consent))

    _, records = asyncio.run(work())
    assert ended(records[DEVICES[0]]).status is Status.DONE
    assert ended(records[DEVICES[1]]).status is Status.REFUSED
    assert not any(isinstance(record, Heading | Finding) for record in records[DEVICES[1]])


def test_stop_ends_a_run_cleanly_and_gives_up_what_waits() -> None:
    async def work() -> Records:
        async with scheduler() as address, workers_here(address, [SLOW_ROBOT]):
            return await on_workers(
                address, [SLOW_ROBOT, "fake:mini"], until=lambda record: isinstance(record, Finding)
            )

    records = asyncio.run(work())
    assert ended(records[SLOW_ROBOT]).status is Status.INCOMPLETE
    assert 0 < len(findings_of(records[SLOW_ROBOT])) < len(alone(SLOW_ROBOT)[0])
    assert ended(records["fake:mini"]).trouble == "stopped while it waited for a host"


def test_a_worker_whose_client_has_left_sends_no_more(tmp_path: Path) -> None:
    from sphero_probe.fleet.dask.client import DaskFleet

    ledger = tmp_path / "ledger"
    device = f"{SLOW_ROBOT}&ledger={ledger}"

    async def work() -> tuple[int, int]:
        async with scheduler() as address, workers_here(address, [device]):
            fleet = DaskFleet(fleet_of([device]), SWEEP, without_journal, scheduler=address)
            async with aclosing(fleet.records()) as records:
                async for _, record in records:
                    if isinstance(record, Finding):
                        break
            await asyncio.sleep(0.3)
            then = len(ledger.read_bytes())
            await asyncio.sleep(0.3)
            return then, len(ledger.read_bytes())

    then, later = asyncio.run(work())
    assert 0 < then == later


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has a file that is always full")
def test_a_run_whose_journal_cannot_be_written_ends_also_on_its_worker(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"
    full = f"{SLOW_ROBOT}&ledger={ledger}"

    def journal_for(robot: FleetRobot) -> RunJournal:
        return RunJournal("sweep", file="/dev/full" if robot.device == full else None)

    async def work() -> Records:
        async with scheduler() as address, workers_here(address, [full, SLOW_ROBOT]):
            return await on_workers(address, [full, SLOW_ROBOT], journal_for=journal_for)

    records = asyncio.run(work())
    assert ended(records[full]).status is Status.FAILED
    assert "/dev/full" in ended(records[full]).trouble
    assert ended(records[SLOW_ROBOT]).status is Status.DONE
    assert ledger.read_bytes().count(b"\n") < len(findings_of(records[SLOW_ROBOT])) / 2


def test_a_worker_that_ends_leaves_its_run_to_another(tmp_path: Path) -> None:
    journal = tmp_path / "journal"

    async def work() -> Records:
        async with scheduler() as address, workers_here(address, [SLOW_ROBOT], [SLOW_ROBOT]) as stops:

            def until(record: FleetRecord) -> bool:
                if isinstance(record, Finding) and record.number == 20:
                    stops.pop(0).set()
                return False

            return await on_workers(
                address,
                [SLOW_ROBOT],
                journal_for=lambda _: RunJournal("sweep", file=str(journal)),
                until=until,
            )

    records = asyncio.run(work())
    found = [record for record in records[SLOW_ROBOT] if isinstance(record, Finding)]
    assert ended(records[SLOW_ROBOT]).status is Status.DONE
    assert said(findings_of(found)) == said(findings_of(alone(SLOW_ROBOT)[0]))
    assert len(found) == len(findings_of(found))  # none is told twice
    assert len(read_journal(journal).headings) in (1, 2)  # it may have been the idle worker


def test_lights_show_on_every_robot(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"
    device = f"fake:bolt-plus?seed=3&ledger={ledger}"
    robots = fleet_of([device])
    options = RobotOptions(FleetConsent(frozenset({Risk.READ, Risk.PROBE, Risk.WRITE})))

    async def work() -> Records:
        async with scheduler() as address, workers_here(address, [device]):
            return await on_workers(address, [device], LedAction(colours_of(robots)), options=options)

    records = asyncio.run(work())
    assert isinstance(records[device][-1], Ended)
    assert ended(records[device]).status is Status.DONE
    executed = [json.loads(line) for line in ledger.read_text().splitlines()]
    assert sum(command["risk"] != "read" for command in executed) == 1
