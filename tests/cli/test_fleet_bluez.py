"""``fleet`` through unpatched bleak and the fake BlueZ: adapters are shared within their limits."""

import tomllib
from pathlib import Path

import pytest

from tests.support.cli import Cli
from tests.support.fake_bluez import Adapter, Faults, Peripheral
from tests.support.fake_bluez_stage import Stage, rows_of, said

ADAPTERS = (Adapter("hci0"), Adapter("hci1", address="00:1A:7D:DA:71:14"))
OFF = Adapter("hci2", powered=False, address="00:1A:7D:DA:71:15")
pytestmark = pytest.mark.usefixtures("limited")


@pytest.fixture
def stage(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> Stage:
    return Stage(cli, monkeypatch)


def six(stage: Stage) -> list[Peripheral]:
    return [stage.robot(f"bolt-plus?seed={number}", f"AA:BB:CC:DD:EE:0{number}") for number in range(6)]


def named(robots: list[Peripheral]) -> list[str]:
    return [word for robot in robots for word in ("--device", robot.address)]


@pytest.mark.parametrize("limit", [3, 1])
def test_each_of_two_adapters_carries_no_more_than_its_limit(stage: Stage, limit: int) -> None:
    robots = six(stage)
    ran = stage.run(
        robots,
        *("fleet", "sweep", "--did", "0x13", "--cid", "0x00-0x0f", "--format", "jsonl"),
        *("--per-adapter", str(limit), *named(robots)),
        adapters=(*ADAPTERS, OFF),
    )
    assert ran.code == 0, ran.err
    told = rows_of(ran, "fleet_robot")
    used = [row["adapter"] for row in told]
    assert set(used) == {"hci0", "hci1"} == set(stage.bluez.most_links)
    assert limit < 3 or used.count("hci0") == 3
    assert all(1 <= most <= limit for most in stage.bluez.most_links.values())
    assert {row["status"] for row in told} == {"done"}
    assert {command.risk.word for command in stage.executed} <= {"read"}
    assert not any(robot.counts.connected > 1 for robot in robots)


def test_only_the_named_adapter_is_used(stage: Stage) -> None:
    robots = six(stage)[:2]
    ran = stage.run(robots, "fleet", "health", "--adapter", "hci1", *named(robots), adapters=ADAPTERS)
    assert ran.code == 0, ran.err
    assert set(stage.bluez.most_links) == {"hci1"}


def test_a_dropped_link_is_opened_again_through_the_same_adapter_in_turn(stage: Stage) -> None:
    robots = six(stage)[:2]
    dropping = stage.robot("bolt-plus?seed=7", "AA:BB:CC:DD:EE:07", faults=Faults(drop_at_write=35))
    ran = stage.run(
        [*robots, dropping],
        *("fleet", "sweep", "--did", "0x13", "--cid", "0x00-0x1f", "--format", "jsonl"),
        *named([*robots, dropping]),
        adapters=ADAPTERS[:1],
    )
    assert ran.code == 0, ran.err
    assert dropping.counts.connected > 1
    assert {row["status"] for row in rows_of(ran, "fleet_robot")} == {"done"}


def test_a_robot_that_cannot_be_connected_leaves_its_place_to_the_others(stage: Stage) -> None:
    robots = six(stage)[:2]
    stuck = stage.robot(
        "bolt-plus?seed=8", "AA:BB:CC:DD:EE:08", faults=Faults(connect_errors=("Page Timeout",) * 50)
    )
    ran = stage.run(
        [stuck, *robots],
        *("fleet", "health", "--per-adapter", "1", "--format", "jsonl", *named([stuck, *robots])),
        adapters=ADAPTERS[:1],
    )
    assert ran.code == 5
    assert [row["status"] for row in rows_of(ran, "fleet_robot")] == ["unreachable", "done", "done"]


def test_all_robots_nearby_are_scanned_by_every_adapter_and_saved(stage: Stage, tmp_path: Path) -> None:
    robots = six(stage)[:3]
    file = tmp_path / "class.toml"
    ran = stage.run(
        robots, "fleet", "scan", "--timeout", "0.5", "--save", str(file), "--json", adapters=ADAPTERS
    )
    assert ran.code == 0, ran.err
    saved = tomllib.loads(file.read_text(encoding="utf-8"))["robot"]
    assert {robot["address"] for robot in saved} == {robot.address for robot in robots}
    assert {robot["name"] for robot in saved} == {robot.name for robot in robots}
    ran = stage.run(robots, "fleet", "health", "--robots", str(file), "--format", "jsonl", adapters=ADAPTERS)
    assert ran.code == 0, ran.err
    assert len(rows_of(ran, "fleet_robot")) == 3


def test_without_bluetooth_there_is_no_fleet(stage: Stage) -> None:
    ran = stage.run([], "fleet", "health", "--all", "--connect-timeout", "0.2", adapters=())
    said(ran, "adapter", code=9)


def test_no_robot_nearby(stage: Stage) -> None:
    ran = stage.run([], "fleet", "health", "--all", "--connect-timeout", "0.2", adapters=ADAPTERS)
    said(ran, "no robot was heard", code=3)
