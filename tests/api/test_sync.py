"""The API without async: the same results, also inside a running loop, and no threads left behind."""

import asyncio
import json
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from sphero_probe import Outcome, sync
from sphero_probe.errors import LinkLostError, RefusedByPolicyError, UsageError

ROOT = Path(__file__).resolve().parents[2]


def threads() -> set[str]:
    return {thread.name for thread in threading.enumerate()}


def test_it_does_what_the_async_form_does() -> None:
    with sync.connect("fake:bolt-plus", consent=["write"]) as robot:
        assert (robot.name, robot.address) == ("BP-BE56", "fake:bolt-plus")
        assert robot.model is not None
        assert robot.model.key == "bolt-plus"
        assert robot.generation == "v2"
        assert robot.leds == ("front", "back")
        assert robot.consent.words == ("read", "probe", "write")
        assert repr(robot) == "<SyncRobot 'BP-BE56', Sphero BOLT+>"
        assert robot.firmware() == {"primary": "5.1.450"}
        assert robot.send("power.get_battery_percentage").percentage == 49
        assert robot.set_led("front", "ff0000").ok
        assert robot.set_leds({}, off=True)[0].ok
        assert robot.run("hello").collect().complete
        sweep = robot.sweep(did="power", cid=range(0x20))
        assert [finding.number for finding in sweep if finding.outcome is Outcome.EXISTS]
        assert len(sweep.result.findings) == 0x20
        assert len(list(robot.discover(did=[0x13]).records())) > 0x100
        with pytest.raises(RefusedByPolicyError):
            robot.send("power.enter_deep_sleep", payload=b"\0")
    assert "sphero-probe" not in threads()


def test_it_works_inside_a_running_loop_as_in_a_notebook() -> None:
    async def cell() -> object:
        with sync.connect("fake:bolt-plus") as robot:
            return robot.send("power.get_battery_percentage").percentage

    assert asyncio.run(cell()) == 49


def test_leaving_a_loop_early_closes_it() -> None:
    with sync.connect("fake:bolt-plus") as robot:
        for _ in robot.sweep(did="power"):
            break
        assert robot.sweep("power", range(4)).collect().complete


def test_iterators_outlive_the_connection_quietly() -> None:
    with sync.connect("fake:bolt") as robot:
        findings = iter(robot.sweep(did="power"))
        next(findings)
        heard = robot.notifications()
    with pytest.raises(LinkLostError, match="the connection was closed"):
        robot.send("power.wake")
    with pytest.raises(LinkLostError, match="the connection was closed"):
        next(findings)
    del findings, heard


def test_notifications() -> None:
    with sync.connect("fake:bolt", consent=["write"]) as robot:
        heard = robot.notifications(seconds=2)
        robot.send("sensor.set_sensor_streaming_mask", payload=bytes.fromhex("0032000000e000"))
        assert next(heard).name == "sensor.sensor_streaming_data_notify"
        robot.send("sensor.set_sensor_streaming_mask", payload=bytes(7))
        heard.close()  # type: ignore[attr-defined]
        assert list(robot.notifications(seconds=0.01)) == []


def test_an_error_in_the_block_propagates_and_the_thread_ends() -> None:
    with pytest.raises(ZeroDivisionError), sync.connect("fake:bolt"):
        raise ZeroDivisionError
    with pytest.raises(UsageError, match="nope"), sync.connect("fake:nope"):
        raise AssertionError
    assert "sphero-probe" not in threads()


def test_an_interrupt_cancels_what_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    class Interrupted:
        def __init__(self, future: object) -> None:
            self.future = future

        def result(self) -> None:
            raise KeyboardInterrupt

        def cancel(self) -> None:
            self.future.cancel()  # type: ignore[attr-defined]

    with sync.connect("fake:bolt?latency=60s") as robot:
        with monkeypatch.context() as patch:
            submit = asyncio.run_coroutine_threadsafe
            patch.setattr(
                asyncio, "run_coroutine_threadsafe", lambda coro, loop: Interrupted(submit(coro, loop))
            )
            with pytest.raises(KeyboardInterrupt):
                robot.send("power.wake")
        assert robot.name


def test_it_stays_open_until_closed_as_over_several_cells() -> None:
    robot = sync.connect("fake:bolt-plus")
    assert robot.send("power.wake").ok
    robot.close()
    robot.close()
    with pytest.raises(LinkLostError):
        robot.send("power.wake")
    assert "sphero-probe" not in threads()


def test_a_forgotten_robot_is_closed_at_the_end_of_the_program(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"
    code = (
        "import sphero_probe.sync as sync\n"
        f"robot = sync.connect('fake:rvr?ledger={ledger}', consent=['motion'])\n"
        "robot.send('drive.set_raw_motors', payload=bytes([1, 99, 1, 99]))\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert ran.stderr == ""
    assert [json.loads(line)["payload"] for line in ledger.read_text().splitlines()] == [
        "01630163",
        "00000000",
    ]


def test_discover_in_one_call() -> None:
    assert sync.discover("fake:mini").complete
