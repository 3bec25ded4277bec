"""Running plans: every way to end one leaves nothing in flight."""

import asyncio
import gc
from pathlib import Path

import pytest

from sphero_probe import Command, Finding, Note, Plan, Probe, Run, Summary, connect, load_run, sweep
from sphero_probe.errors import BadInputFileError, LinkLostError, NoAnswerError, OutputError, UsageError
from tests.support.cli import Cli
from tests.support.virtual_clock import run

SLOW = "fake:bolt-plus?latency=15ms"


def test_a_sweep_yields_a_finding_per_probe_and_keeps_the_rest() -> None:
    async def work() -> None:
        async with connect("fake:bolt-plus") as robot:
            running = robot.sweep(did=0x13, cid=range(0x20))
            assert running.result == Run()
            findings = [finding async for finding in running]
            assert sorted(finding.number for finding in findings) == list(range(1, 0x21))
            result = running.result
            assert result.findings == tuple(sorted(findings, key=lambda finding: finding.number))
            assert result.complete
            assert result.heading is not None
            assert result.heading.firmware == {"primary": "5.1.450"}
            assert any(note.kind == "calibration" for note in result.notes)
            assert result.summary is not None
            assert sum(result.summary.counts.values()) == 0x20
            battery = result.find("power.get_battery_percentage")
            assert battery in result.existing
            assert battery is not None
            assert (battery.code, battery.payload, battery.fields) == (0, b"\x31", {"percentage": 49})
            assert result.find("power.no_such_command") is None

    run(work())


@pytest.mark.parametrize(
    ("did", "cid", "count"),
    [
        (0x13, range(4), 4),
        ("power", [0x10], 1),
        (["power", 0x11], "0x00-0x03", 8),
        ("0x10-0x11,power", "0x10", 3),
        ([0x13, "power", 19], [1, 1, 2], 2),
    ],
)
def test_ids_can_be_written_in_several_ways(did: object, cid: object, count: int) -> None:
    async def work() -> Run:
        async with connect("fake:bolt-plus") as robot:
            return await robot.sweep(did, cid).collect()  # type: ignore[arg-type]

    assert len(run(work()).findings) == count


@pytest.mark.parametrize(("did", "cid"), [("pwer", 0), (0x100, 0), (0x13, -1), ("0x1f-0x10", 0), (None, 0)])
def test_invalid_ids(did: object, cid: object) -> None:
    async def work() -> None:
        async with connect("fake:bolt-plus") as robot:
            with pytest.raises((UsageError, TypeError)):
                robot.sweep(did, cid)  # type: ignore[arg-type]

    run(work())


def test_a_node_and_a_payload_are_those_that_were_named() -> None:
    async def work() -> Run:
        async with connect("fake:rvr") as robot:
            return await robot.sweep(0x11, [0x00], target="secondary", payload=b"").collect()

    (finding,) = run(work()).findings
    assert (finding.command.target, finding.fields["major"]) == (0x12, 6)


def test_leaving_the_loop_ends_the_run() -> None:
    async def work() -> None:
        async with connect(SLOW) as robot:
            running = robot.sweep(did=0x13)
            async for _ in running:
                break
            assert len(running.result.findings) < 256
            assert (await robot.sweep("power", range(4)).collect()).complete  # waits for the first to end
            async for _ in robot.sweep(did=0x13):
                break

    run(work())


def test_an_iterator_that_is_still_held_is_closed_with_the_connection() -> None:
    async def work() -> None:
        async with connect(SLOW) as robot:
            findings = aiter(robot.sweep(did=0x13))
            await anext(findings)
        with pytest.raises(StopAsyncIteration):
            await anext(findings)

    run(work())


def test_an_iterator_that_was_never_started_costs_nothing() -> None:
    async def work() -> None:
        async with connect(SLOW) as robot:
            robot.sweep(did=0x13)
            aiter(robot.sweep(did=0x13))
            gc.collect()

    run(work())


@pytest.mark.parametrize("seconds", [0.0, 0.01, 0.1, 0.5, 1.0])
def test_cancelling_closes_cleanly(seconds: float) -> None:
    async def work() -> None:
        async def sweep_all() -> None:
            async with connect(SLOW) as robot:
                await robot.sweep(did=range(0x10, 0x14)).collect()

        task = asyncio.create_task(sweep_all())
        await asyncio.sleep(seconds)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    run(work())


def test_a_task_that_still_iterates_is_told_when_the_connection_is_left() -> None:
    async def work() -> None:
        async with connect(SLOW) as robot:
            task = asyncio.create_task(robot.sweep(did=range(0x10, 0x14)).collect())
            await asyncio.sleep(0.5)
        (ended,) = await asyncio.gather(task, return_exceptions=True)
        assert isinstance(ended, LinkLostError) or not ended.complete  # type: ignore[union-attr]

    run(work())


def test_stopping_ends_with_an_incomplete_summary() -> None:
    async def work() -> Run:
        async with connect(SLOW) as robot:
            running = robot.sweep(did=0x13)
            async for finding in running:
                if finding.number == 20:
                    running.stop()
            return running.result

    result = run(work())
    assert result.summary is not None
    assert not result.complete
    assert 20 <= len(result.findings) < 256


def test_a_plan_runs_once_and_one_at_a_time() -> None:
    async def work() -> None:
        async with connect(SLOW) as robot:
            running = robot.sweep("power", range(3))
            async for _ in running:
                with pytest.raises(RuntimeError, match="a plan is running"):
                    await robot.sweep("power").collect()
                assert (await robot.send(0x13, 0x10)).ok  # single commands may be sent in between
            with pytest.raises(RuntimeError, match="has been run"):
                await running.collect()

    run(work())


def test_records_are_everything_in_order() -> None:
    async def work() -> list[object]:
        async with connect("fake:bolt-plus") as robot:
            return [record async for record in robot.sweep("power", range(16)).records()]

    records = run(work())
    assert isinstance(records[-1], Summary)
    assert {type(record) for record in records[1:-1]} == {Finding, Note}


def test_plans_made_in_code_and_named() -> None:
    plan = Plan(
        "mine", "two stages", [[Probe(Command(0x13, 0x10))], lambda found: sweep([0x13], [len(found)])]
    )

    async def work() -> None:
        async with connect("fake:bolt-plus") as robot:
            running = robot.run(plan)
            assert running.plan is plan
            assert [finding.command.cid async for finding in running] == [0x10, 1]
            assert len((await robot.run("hello").collect()).existing) == 4
            with pytest.raises(BadInputFileError, match="no such plan"):
                robot.run("no_such_plan")
            broken = Plan("broken", "", [lambda _: 1 / 0])  # type: ignore[list-item,return-value]
            with pytest.raises(BadInputFileError, match="ZeroDivisionError"):
                await robot.run(broken).collect()
            assert (await robot.run("hello").collect()).complete

    run(work())


def test_a_silent_robot_is_an_error() -> None:
    pairs = ",".join(f"0x{did:02x}:0x{cid:02x}" for did in (0x10, 0x11, 0x13) for cid in range(0x20))

    async def work() -> None:
        async with connect(f"fake:bolt-plus?silent={pairs}") as robot:
            await robot.sweep("power").collect()

    with pytest.raises(NoAnswerError):
        run(work())


def test_a_dropped_link_is_opened_again() -> None:
    async def work() -> Run:
        async with connect("fake:bolt-plus?disconnect_after=60") as robot:
            found = await robot.sweep("power").collect()
            assert (await robot.send("power.get_battery_percentage")).ok  # on the new link
            return found

    assert run(work()).complete


def test_a_journal_is_what_load_run_and_the_command_line_read(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"

    async def work() -> Run:
        async with connect("fake:bolt-plus") as robot:
            return await robot.sweep("power", range(0x20), journal=path).collect()

    found = run(work())
    loaded = load_run(path)
    assert loaded.complete
    assert loaded.heading == found.heading
    assert [(one.number, one.outcome, one.fields) for one in loaded.findings] == [
        (one.number, one.outcome, one.fields) for one in found.findings
    ]
    assert "get_battery_percentage" in cli("report", str(path)).out
    resumed = cli("sweep", "--resume", str(path), "--device", "fake:bolt-plus", "--format", "plain")
    assert resumed.code == 0, resumed.err
    with pytest.raises(OutputError, match="the file is not empty"):
        run(work())
    with pytest.raises(BadInputFileError, match="no such run"):
        load_run("no-such-run")


def test_an_interrupted_journal_is_resumed_on_the_command_line(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"

    async def work() -> None:
        async with connect("fake:bolt-plus") as robot:
            async for finding in robot.sweep("power", journal=path):
                if finding.number == 40:
                    break

    run(work())
    assert load_run(path).summary is None
    ran = cli("sweep", "--resume", str(path), "--device", "fake:bolt-plus", "--format", "plain")
    assert ran.code == 0, ran.err
    assert load_run(path).complete
