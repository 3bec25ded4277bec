"""``sphero_probe.Fleet``: pairs of robot and finding, and how each robot ended."""

import asyncio
from pathlib import Path

import pytest

from sphero_probe import Finding, Fleet, FleetRobot, RobotResult, connect
from sphero_probe.errors import BadInputFileError, UsageError
from sphero_probe.fleet.records import Status
from tests.support.fleet import findings_of
from tests.support.virtual_clock import run

ONE, OTHER, GONE = "fake:bolt-plus?seed=1", "fake:rvr?seed=2", "fake:bolt?seed=3&disconnect_after=2"


def test_a_sweep_yields_pairs_of_robot_and_finding() -> None:
    async def work() -> tuple[dict[str, list[Finding]], list[Finding]]:
        found: dict[str, list[Finding]] = {}
        run = Fleet([ONE, OTHER, GONE]).sweep("power", range(0x20))
        async for robot, finding in run:
            assert isinstance(robot, FleetRobot)
            found.setdefault(robot.device, []).append(finding)
        assert {name: result.ended.status for name, result in run.results.items() if result.ended} == {
            ONE: Status.DONE,
            OTHER: Status.DONE,
            GONE: Status.INCOMPLETE,
        }
        assert run.results[ONE].battery
        with pytest.raises(RuntimeError, match="started"):
            await run.collect()
        async with connect(ONE) as single:
            alone = [finding async for finding in single.sweep("power", range(0x20))]
        return found, alone

    found, alone = run(work())
    assert findings_of(found[ONE]) == findings_of(alone)
    assert set(found) == {ONE, OTHER}


def test_health_and_discover_give_results() -> None:
    async def work() -> None:
        health = await Fleet([ONE, OTHER]).health().collect()
        assert set(health[OTHER].firmware) == {"primary", "secondary"}
        found = await Fleet([ONE]).discover(did=[0x13]).collect()
        assert found[ONE].counts

    run(work())


def test_stop_and_leaving_the_loop_end_every_run() -> None:
    async def work() -> None:
        run = Fleet([ONE, OTHER]).sweep(range(0x10, 0x14))
        async for _ in run:
            run.stop()
        assert {result.ended.status for result in run.results.values() if result.ended} == {Status.INCOMPLETE}
        async for _ in Fleet([ONE, OTHER]).sweep(0x13):
            break
        await asyncio.sleep(1)  # the event loop closes what was left; ``run`` checks that no task stays

    run(work())


def test_a_fleet_file_and_journals(tmp_path: Path) -> None:
    file = tmp_path / "class.csv"
    file.write_text(f"name,address\nleft,{ONE}\nright,{OTHER}\n", encoding="utf-8")

    async def work() -> dict[str, RobotResult]:
        return await Fleet(file).sweep(0x13, range(8), journal=True).collect()

    results = run(work())
    assert list(results) == ["left", "right"]
    for result in results.values():
        assert result.ended
        assert Path(result.ended.journal).read_bytes()
    with pytest.raises(BadInputFileError):
        Fleet(tmp_path / "none.csv")


@pytest.mark.parametrize("robots", [[], [ONE, ONE], ["fake:nothing"]])
def test_a_fleet_that_is_none(robots: list[str]) -> None:
    with pytest.raises(UsageError):
        Fleet(robots)
