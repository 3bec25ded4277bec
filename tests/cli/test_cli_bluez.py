"""The whole tool through unpatched bleak and D-Bus, as subprocesses against the fake BlueZ."""

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from tests.support.cli import objects
from tests.support.fake_bluez import (
    V2_API,
    V2_GATE,
    BusFaults,
    FakeBlueZ,
    Faults,
    Peripheral,
    sphero_v2,
)
from tests.support.processes import rest_of

PATIENCE = 60
"""Seconds for one run of the tool; far more than it needs."""
NEW, OLD, DROID = "AA:BB:CC:DD:EE:01", "AA:BB:CC:DD:EE:02", "AA:BB:CC:DD:EE:03"


class Stage:
    """Robots on the air, and what they executed."""

    def __init__(self) -> None:
        self.executed: list[Executed] = []

    def robot(self, settings: str, address: str, **profile: Any) -> Peripheral:
        robot = FakeRobot(parse_settings(settings), on_execute=self.executed.append)
        faults = profile.pop("faults", Faults())
        return Peripheral(
            robot.name, address, robot=robot, services=sphero_v2(**profile), faults=faults, mtu=247
        )


@pytest.fixture
def stage() -> Stage:
    return Stage()


def probe(bluez: FakeBlueZ, *arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "sphero_probe", *arguments],
        env={**os.environ, "DBUS_SYSTEM_BUS_ADDRESS": bluez.address},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


def start(bluez: FakeBlueZ, *arguments: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "sphero_probe", *arguments],
        env={**os.environ, "DBUS_SYSTEM_BUS_ADDRESS": bluez.address},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_scan_lists_the_robots_and_nothing_else(stage: Stage) -> None:
    stranger = Peripheral("Kettle\x1b[31m", "AA:BB:CC:DD:EE:09")
    robots = [stage.robot("bolt-plus", NEW, gate=False), stage.robot("bolt", OLD), stranger]
    with FakeBlueZ(robots) as bluez:
        ran = probe(bluez, "scan", "--timeout", "0.5", "--json")
    assert ran.returncode == 0
    found = {robot["address"]: robot for robot in json.loads(ran.stdout)}
    assert {address: (robot["model"], robot["generation"]) for address, robot in found.items()} == {
        NEW: ("Sphero BOLT+", "v2"),
        OLD: ("Sphero BOLT", "v2"),
    }
    assert found[NEW]["name"].startswith("BP-")
    assert found[OLD]["name"].startswith("SB-")


def test_scan_finds_nobody(stage: Stage) -> None:
    with FakeBlueZ([]) as bluez:
        ran = probe(bluez, "scan", "--timeout", "0.3", "--json")
    assert ran.returncode == 0
    assert json.loads(ran.stdout) == []
    assert "no robot was heard" in ran.stderr


@pytest.mark.parametrize(
    ("settings", "address", "gate", "prefix"),
    [("bolt", OLD, True, "SB-"), ("bolt-plus", NEW, False, "BP-")],
    ids=["bolt-with-handshake", "bolt-plus-without"],
)
def test_sweep_executes_reads_only(
    stage: Stage, settings: str, address: str, gate: bool, prefix: str
) -> None:
    peripheral = stage.robot(settings, address, gate=gate)
    with FakeBlueZ([peripheral]) as bluez:
        ran = probe(
            bluez, "sweep", "--did", "power", "--cid", "0x00-0x1f", "--format", "jsonl", "-d", address
        )
    assert ran.returncode == 0, ran.stderr
    rows = objects(ran.stdout)
    assert rows[0]["device"].startswith(prefix)
    assert rows[0]["strictness"] == {"primary": "strict"}
    findings = {row["cid"]: row for row in rows if row["type"] == "finding"}
    assert sorted(findings) == list(range(0x20))
    assert findings[0x03]["outcome"] == "exists"
    assert findings[0x03]["fields"]["voltage"] > 3
    assert findings[0x00]["outcome"] == "skipped"
    assert {command.risk.word for command in stage.executed} == {"read"}
    first, *_ = peripheral.written
    assert first == ((V2_GATE, b"usetheforce...band") if gate else (V2_API, first[1]))


def test_led_puts_exactly_the_packet_of_the_reference_on_the_air(stage: Stage) -> None:
    peripheral = stage.robot("bolt-plus", NEW, gate=False)
    assert isinstance(peripheral.name, str)
    assert isinstance(peripheral.robot, FakeRobot)
    with FakeBlueZ([peripheral]) as bluez:
        both = probe(bluez, "led", "--front", "ff0000", "--back", "ff0000", "-d", peripheral.name)
        front = probe(bluez, "led", "--front", "00ff00", "-d", peripheral.name)
    assert (both.returncode, front.returncode) == (0, 0), both.stderr + front.stderr
    assert both.stderr == ""
    assert [data.hex() for _, data in peripheral.written] == [
        "8d3a11011a1c003fff0000ff000040d8",
        "8d3a11011a1c000700ff0077d8",
    ]
    assert peripheral.robot.leds["front_green"] == 255
    assert peripheral.robot.leds["front_red"] == 0
    assert peripheral.robot.leds["back_red"] == 255


def test_info_tells_what_the_robot_says(stage: Stage) -> None:
    peripheral = stage.robot("bolt", OLD)
    with FakeBlueZ([peripheral]) as bluez:
        ran = probe(bluez, "info", "--json", "-v", "--connect-timeout", "1")
    assert ran.returncode == 0, ran.stderr
    facts = {(fact["name"], fact["node"]): fact["value"] for fact in json.loads(ran.stdout)}
    assert facts["model", None] == "Sphero BOLT"
    assert facts["bluetooth_name", "primary"] == peripheral.name
    assert ("main_app_version", "secondary") in facts
    assert [line.split()[-1] for line in ran.stderr.splitlines()][:5] == [
        "scan",
        "connect",
        "services",
        "handshake",
        "notify",
    ]


def test_an_api_that_appears_after_the_handshake_is_found(stage: Stage) -> None:
    droid = stage.robot("r2d2", DROID, reveals_api_after_handshake=True)
    with FakeBlueZ([droid]) as bluez:
        ran = probe(bluez, "info", "--json", "-d", DROID)
    assert ran.returncode == 0, ran.stderr
    assert '"R2-D2"' in ran.stdout


def test_a_link_that_drops_in_a_sweep_is_opened_again(stage: Stage) -> None:
    faults = Faults(drop_at_write=90)
    peripheral = stage.robot("bolt-plus", NEW, gate=False, faults=faults)
    with FakeBlueZ([peripheral]) as bluez:
        ran = probe(bluez, "sweep", "--did", "0x13", "--format", "jsonl", "-d", NEW)
        assert len(bluez.called("Connect")) > 1
    assert ran.returncode == 0, ran.stderr
    rows = objects(ran.stdout)
    assert rows[-1]["complete"] is True
    findings = [row for row in rows if row["type"] == "finding"]
    assert sorted(row["cid"] for row in findings) == list(range(256))
    assert {command.risk.word for command in stage.executed} == {"read"}


def test_a_robot_that_does_not_come_back_leaves_what_was_found(stage: Stage) -> None:
    faults = Faults(drop_at_write=60)
    peripheral = stage.robot("bolt-plus", NEW, gate=False, faults=faults)
    with FakeBlueZ([peripheral]) as bluez:
        command = ["sweep", "--did", "0x13", "--format", "jsonl", "-d", NEW, "--connect-timeout", "0.5"]
        running = start(bluez, *command)
        assert running.stdout
        seen = [running.stdout.readline() for _ in range(3)]
        bluez.remove(peripheral)
        out, err = rest_of(running)
    assert running.returncode in (3, 4), err
    rows = objects("".join(seen) + out)
    assert rows[-1]["type"] == "summary"
    assert rows[-1]["complete"] is False
    assert "--resume" in err
    assert "Traceback" not in err


def one_line(ran: "subprocess.CompletedProcess[str]", said: str) -> None:
    first, *more = ran.stderr.splitlines()
    assert said in ran.stderr
    assert first.startswith("sphero-probe: ")
    assert len(more) <= 1
    assert "Traceback" not in ran.stderr


def test_what_fails_while_connecting_is_all_that_is_said(stage: Stage) -> None:
    peripheral = stage.robot("bolt-plus", NEW, gate=False, faults=Faults(never_resolves=True))
    with FakeBlueZ([peripheral]) as bluez:
        ran = probe(bluez, "info", "-d", NEW, "--connect-timeout", "0.2")
    assert ran.returncode == 4, ran.stderr
    one_line(ran, "services: the robot is connected")


def test_a_bus_that_dies_is_all_that_is_said(stage: Stage) -> None:
    peripheral = stage.robot("bolt-plus", NEW, gate=False)
    with FakeBlueZ([peripheral], faults=BusFaults(hangs_up_at="StartNotify")) as bluez:
        ran = probe(bluez, "info", "-d", NEW, "--connect-timeout", "0.2")
    assert ran.returncode == 9, ran.stderr
    one_line(ran, "the connection to D-Bus broke")


def test_no_bus_at_all() -> None:
    env = {**os.environ, "DBUS_SYSTEM_BUS_ADDRESS": "unix:path=/no/such/socket"}
    ran = subprocess.run(
        [sys.executable, "-m", "sphero_probe", "scan"],
        env=env,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert ran.returncode == 9
    one_line(ran, "no system bus")


def test_several_robots_are_never_chosen_from(stage: Stage) -> None:
    robots = [stage.robot("bolt-plus", NEW, gate=False), stage.robot("bolt", OLD)]
    with FakeBlueZ(robots) as bluez:
        ran = probe(bluez, "info", "--connect-timeout", "0.5")
    assert ran.returncode == 3
    one_line(ran, "2 robots are near")
