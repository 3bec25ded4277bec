"""``doctor`` on machines that work and on machines that do not, against the fake BlueZ."""

import asyncio
import io
import json
import math
import os
import re
import socket
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from time import monotonic
from types import SimpleNamespace
from typing import Any

import pytest
from bleak import BleakScanner
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.diagnostics import bluetooth as bluetooth_checks
from sphero_probe.diagnostics import checkup
from sphero_probe.diagnostics import machine as machine_checks
from sphero_probe.diagnostics.robot import Steps, check_robot
from sphero_probe.errors import UnavailableError
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.probing.latency import RoundTrips, measure_round_trips
from sphero_probe.protocol import CODECS
from sphero_probe.reports.checks import Look, State
from sphero_probe.session.addressing import address_of
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports import serial
from sphero_probe.transports.base import WHY_UNHEARD, OpenOptions
from sphero_probe.transports.ble import machine
from sphero_probe.transports.registry import open_transport
from tests.support.cli import Cli
from tests.support.fake_bluez import (
    ACCESS_DENIED,
    Adapter,
    BusFaults,
    FakeBlueZ,
    Faults,
    Peripheral,
    sphero_v2,
)
from tests.support.virtual_clock import run as run_on_virtual_clock

ROBOT = "AA:BB:CC:DD:EE:01"
WAIT = 0.5
"""Seconds given to what never answers."""
MEMBERSHIP = bluetooth_checks.membership
pytestmark = pytest.mark.usefixtures("limited")
ROBOT_CHECKS = ["connection", "services", "write size", "round trips", "firmware", "battery"]


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A machine of its own: no ports, no switches, no container, BlueZ tools of a version."""
    tools = tmp_path / "bin"
    tools.mkdir()
    say_version(tmp_path, "bluetoothctl: 5.66")
    monkeypatch.setenv("PATH", str(tools))
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("container", raising=False)
    monkeypatch.setattr(machine, "RFKILL", tmp_path / "rfkill")
    monkeypatch.setattr(serial, "ports", list)
    monkeypatch.setattr(machine_checks, "CONTAINER_MARKS", (tmp_path / "container",))
    monkeypatch.setattr(bluetooth_checks, "LISTENING", 0.1)
    monkeypatch.setattr(bluetooth_checks, "membership", lambda: ("ada", False, False))
    return tmp_path


def say_version(here: Path, text: str) -> None:
    file = here / "bin" / "bluetoothctl"
    file.write_text(f"#!/bin/sh\necho '{text}'\n")
    file.chmod(0o755)


class Page(dict[str, dict[str, str]]):
    """The checks by name, and how the command ended."""

    code: int
    err: str

    def fails(self) -> list[str]:
        return [name for name, check in self.items() if check["state"] == "fail"]

    def skipped(self) -> list[str]:
        return [name for name, check in self.items() if check["state"] == "skipped"]


Doctor = Callable[..., Page]


@pytest.fixture
def doctor(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> Doctor:
    """Run it against a bus and read its JSON."""

    def ran(bus: str | FakeBlueZ, *arguments: str) -> Page:
        address = bus if isinstance(bus, str) else bus.address
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)
        result = cli("doctor", "--json", *arguments)
        assert "Traceback" not in result.err
        checks = json.loads(result.out)
        keys = {"type", "name", "state", "seen", "fix"}
        assert all(set(check) - {"schema_version"} == keys for check in checks)
        assert {check["type"] for check in checks} == {"check"}
        assert [check.get("schema_version") for check in checks] == [2] + [None] * (len(checks) - 1)
        page = Page({check["name"]: check for check in checks})
        assert len(page) == len(checks)
        assert {check["state"] for check in checks} <= {"ok", "warn", "fail", "skipped"}
        for check in checks:
            assert check["seen"]
            assert check["fix"] or check["state"] in ("ok", "skipped"), check
        page.code, page.err = result.code, result.err
        assert page.code == (1 if page.fails() else 0)
        return page

    return ran


def robot(settings: str = "bolt", mtu: int = 247, **faults: Any) -> Peripheral:
    played = FakeRobot(parse_settings(settings))
    gate = played.model.key == "bolt"
    return Peripheral(
        played.name, ROBOT, robot=played, services=sphero_v2(gate=gate), mtu=mtu, faults=Faults(**faults)
    )


def test_a_healthy_machine(doctor: Doctor) -> None:
    peripheral = robot()
    with FakeBlueZ([peripheral]) as bluez:
        page = doctor(bluez)
        assert not bluez.called("Connect")
    assert page.code == 0
    assert list(page) == [
        "Python",
        "system",
        "sphero-probe",
        "bleak",
        "D-Bus",
        "BlueZ version",
        "BlueZ",
        "adapter",
        "radio switch",
        "power",
        "Bluetooth LE",
        "robots in use",
        "scan",
        "serial library",
        "serial ports",
        "terminal",
        "journals",
    ]
    assert {check["state"] for check in page.values()} == {"ok", "skipped"}
    assert page.skipped() == ["radio switch"]
    assert page["BlueZ version"]["seen"] == "5.66"
    assert page["adapter"]["seen"] == "hci0 00:1A:7D:DA:71:13"
    assert isinstance(peripheral.name, str)
    assert f"{peripheral.name} (Sphero BOLT, -50 dBm)" in page["scan"]["seen"]
    assert page.err == "16 ok, 1 skipped; to measure a robot too, add --device ROBOT\n"


def test_many_robots_are_counted_and_strangers_are_no_robots(doctor: Doctor) -> None:
    near = [Peripheral(f"BP-00{number:02}", f"AA:BB:CC:DD:EE:{number:02}") for number in range(7)]
    with FakeBlueZ([*near, Peripheral("Kitchen radio", "AA:BB:CC:DD:EF:01")]) as bluez:
        seen = doctor(bluez)["scan"]["seen"]
    assert "heard 8 devices in 0.1 s: BP-0000 (Sphero BOLT+, -50 dBm), " in seen
    assert seen.endswith(" and 2 more robots")
    assert "Kitchen" not in seen


def test_a_healthy_machine_with_nobody_near(doctor: Doctor) -> None:
    with FakeBlueZ() as bluez:
        page = doctor(bluez)
    assert page.code == 0
    assert "heard 0 devices in 0.1 s, no robot" in page["scan"]["seen"]
    assert page["scan"]["fix"] == f"if a robot is nearby: {WHY_UNHEARD}"


def no_bus(folder: Path) -> str:
    return f"unix:path={folder / 'nothing'}"


def dead_socket(folder: Path) -> str:
    path = os.path.relpath(folder / "dead")
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind(path)
    return f"unix:path={path}"


@pytest.mark.parametrize(
    ("bus", "said"),
    [
        pytest.param(no_bus, "no system bus", id="no-bus"),
        pytest.param(dead_socket, "no system bus", id="dead-socket"),
        pytest.param(lambda _: "gibberish", "makes no sense", id="bad-address"),
    ],
)
def test_without_a_bus_what_stands_on_it_is_skipped(
    doctor: Doctor, here: Path, bus: Callable[[Path], str], said: str
) -> None:
    address = bus(here)
    page = doctor(address, "-d", ROBOT)
    assert page.fails() == ["D-Bus"]
    assert said in page["D-Bus"]["seen"]
    assert address in page["D-Bus"]["seen"]
    below = ["BlueZ", "adapter", "radio switch", "power", "Bluetooth LE", "robots in use", "scan"]
    assert page.skipped() == below + ROBOT_CHECKS
    assert page["adapter"]["seen"] == "no D-Bus"
    assert page["connection"]["seen"] == "Bluetooth is not usable"


def test_a_container_is_told_to_share_the_bus(doctor: Doctor, here: Path) -> None:
    (here / "container").touch()
    page = doctor(no_bus(here))
    assert "inside a container" in page["system"]["seen"]
    assert "-v /run/dbus" in page["D-Bus"]["fix"]


def test_windows_subsystem_is_told_where_its_bluetooth_is(
    doctor: Doctor, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platform.release", lambda: "5.15.90.1-microsoft-standard-WSL2")
    assert "usbipd" in doctor(no_bus(here))["D-Bus"]["fix"]
    with FakeBlueZ(adapters=()) as bluez:
        assert "usbipd" in doctor(bluez)["adapter"]["fix"]


@pytest.mark.parametrize(
    ("faults", "failed", "said", "fix"),
    [
        pytest.param({"absent": True}, "BlueZ", "not running", "bluez", id="no-bluez"),
        pytest.param(
            {"errors": {"*": ACCESS_DENIED}}, "BlueZ", "denied", "usermod -aG bluetooth ada", id="denied"
        ),
        pytest.param(
            {"unanswered": frozenset({"*"})}, "BlueZ", "does not answer", "restart", id="mute-bluez"
        ),
        pytest.param({"mute": True}, "D-Bus", "does not answer within 0.5 s", "restart", id="mute-bus"),
        pytest.param({"rejects_authentication": True}, "D-Bus", "denies", "AUTH_UID", id="let-nobody-in"),
        pytest.param(
            {"errors": {"StartDiscovery": ACCESS_DENIED}}, "scan", "denied", "usermod", id="may-look-not-scan"
        ),
        pytest.param(
            {"unanswered": frozenset({"StartDiscovery"})}, "scan", "answer", "restart", id="mute-scan"
        ),
    ],
)
def test_a_service_that_fails_is_the_only_failure(
    doctor: Doctor, faults: dict[str, Any], failed: str, said: str, fix: str
) -> None:
    began = monotonic()
    with FakeBlueZ(faults=BusFaults(**faults)) as bluez:
        page = doctor(bluez, "--timeout", str(WAIT))
    assert monotonic() - began < 20  # of more than a minute that bleak and D-Bus would wait
    assert page.fails() == [failed]
    assert said in page[failed]["seen"]
    assert fix in page[failed]["fix"]
    assert failed == "scan" or page["scan"]["state"] == "skipped"


@pytest.mark.parametrize(
    ("member", "active", "fix"),
    [
        pytest.param(True, False, "log out and in again: ada is in the group", id="session-older-than-group"),
        pytest.param(True, True, "D-Bus policy", id="group-does-not-help"),
    ],
)
def test_who_is_in_the_group_is_not_sent_there(
    doctor: Doctor, monkeypatch: pytest.MonkeyPatch, member: bool, active: bool, fix: str
) -> None:
    monkeypatch.setattr(bluetooth_checks, "membership", lambda: ("ada", member, active))
    with FakeBlueZ(faults=BusFaults(errors={"*": ACCESS_DENIED})) as bluez:
        page = doctor(bluez)
    assert fix in page["BlueZ"]["fix"]


@pytest.mark.parametrize(
    ("members", "groups", "told"),
    [
        pytest.param([], [100], (False, False), id="outsider"),
        pytest.param(["ada"], [100], (True, False), id="not-yet"),
        pytest.param(["ada"], [100, 111], (True, True), id="member"),
        pytest.param(None, [100], (False, False), id="no-such-group"),
    ],
)
def test_membership(
    monkeypatch: pytest.MonkeyPatch, members: list[str] | None, groups: list[int], told: tuple[bool, bool]
) -> None:
    def group(name: str) -> SimpleNamespace:
        if members is None:
            raise KeyError(name)
        return SimpleNamespace(gr_mem=members, gr_gid=111)

    monkeypatch.setattr("grp.getgrnam", group)
    monkeypatch.setattr("pwd.getpwuid", lambda _: SimpleNamespace(pw_name="ada"))
    monkeypatch.setattr(os, "getgroups", lambda: groups)
    assert MEMBERSHIP() == ("ada", *told)
    monkeypatch.setattr("pwd.getpwuid", {}.__getitem__)
    assert MEMBERSHIP() == (f"user {os.getuid()}", f"user {os.getuid()}" in (members or ()), told[1])


OFF = Adapter(powered=False)
OLD = Adapter(roles=("peripheral",))
SECOND = Adapter("hci1", address="00:1A:7D:DA:71:14")


@pytest.mark.parametrize(
    ("adapters", "arguments", "states"),
    [
        pytest.param((), (), {"adapter": "fail none", "power": "skipped", "scan": "skipped"}, id="none"),
        pytest.param(
            (OFF,), (), {"power": "fail hci0 is off", "Bluetooth LE": "ok", "scan": "skipped"}, id="off"
        ),
        pytest.param(
            (OLD,),
            (),
            {
                "power": "ok",
                "Bluetooth LE": "fail hci0 cannot connect to robots (no central role)",
                "scan": "skipped",
            },
            id="no-central",
        ),
        pytest.param((Adapter(), SECOND), (), {"adapter": "warn hci0", "scan": "ok"}, id="two"),
        pytest.param(
            (Adapter(), SECOND), ("--adapter", "hci1"), {"adapter": "ok hci0", "scan": "ok"}, id="one-of-two"
        ),
        pytest.param(
            (OFF, SECOND),
            (),
            {"adapter": "ok", "power": "ok hci0 is off, hci1 is on", "scan": "ok"},
            id="one-on",
        ),
        pytest.param(
            (OLD, SECOND),
            (),
            {"Bluetooth LE": "warn hci1 can connect to robots, hci0 cannot"},
            id="one-of-two-cannot",
        ),
        pytest.param(
            (OLD, SECOND._replace(powered=False)),
            (),
            {"power": "ok", "Bluetooth LE": "fail hci0 cannot connect to robots", "scan": "skipped"},
            id="the-wrong-one-on",
        ),
        pytest.param(
            (Adapter(),),
            ("--adapter", "hci7"),
            {"adapter": "fail no adapter hci7; found: hci0", "power": "skipped", "scan": "skipped"},
            id="wrong-name",
        ),
    ],
)
def test_adapters(
    doctor: Doctor,
    adapters: tuple[Adapter, ...],
    arguments: tuple[str, str],
    states: dict[str, str],
) -> None:
    with FakeBlueZ(adapters=adapters) as bluez:
        page = doctor(bluez, *arguments)
    for name, expected in states.items():
        state, _, seen = expected.partition(" ")
        assert page[name]["state"] == state, (name, page[name])
        assert page[name]["seen"].startswith(seen), name
    assert page.fails() == [name for name, expected in states.items() if expected.startswith("fail")]


def block(here: Path, kind: str = "bluetooth", soft: str = "0", hard: str = "0") -> None:
    radio = here / "rfkill" / f"rfkill-{kind}"
    radio.mkdir(parents=True)
    for name, text in (("type", kind), ("soft", soft), ("hard", hard)):
        (radio / name).write_text(f"{text}\n")


@pytest.mark.parametrize(
    ("adapter", "switch", "state", "fix"),
    [
        pytest.param(Adapter(), {}, "ok", "", id="free"),
        pytest.param(OFF, {"soft": "1"}, "fail", "rfkill unblock bluetooth", id="blocked-by-software"),
        pytest.param(OFF, {"hard": "1", "soft": "1"}, "fail", "radio switch or key", id="blocked-by-key"),
        pytest.param(Adapter(), {"soft": "1"}, "warn", "rfkill", id="blocked-and-on"),
        pytest.param(Adapter(), {"kind": "wlan", "soft": "1"}, "skipped", "", id="that-of-another-radio"),
    ],
)
def test_radio_switches(
    doctor: Doctor, here: Path, adapter: Adapter, switch: dict[str, str], state: str, fix: str
) -> None:
    block(here, **switch)
    with FakeBlueZ(adapters=(adapter,)) as bluez:
        found = doctor(bluez)["radio switch"]
    assert found["state"] == state
    assert fix in found["fix"]


@pytest.mark.parametrize(
    ("said", "state"),
    [
        pytest.param("bluetoothctl: 5.54", "fail", id="too-old"),
        pytest.param("bluetoothctl: 5.55", "ok", id="just-new-enough"),
        pytest.param("what?", "skipped", id="no-number"),
    ],
)
def test_version_of_bluez(doctor: Doctor, here: Path, said: str, state: str) -> None:
    say_version(here, said)
    with FakeBlueZ() as bluez:
        assert doctor(bluez)["BlueZ version"]["state"] == state


def test_a_missing_or_hanging_tool_of_bluez_is_no_failure(doctor: Doctor, here: Path) -> None:
    file = here / "bin" / "bluetoothctl"
    file.write_text("#!/bin/sh\nwhile :; do :; done\n")
    assert asyncio.run(machine.bluez_version(0.1)) == ""
    file.unlink()
    with FakeBlueZ() as bluez:
        assert doctor(bluez)["BlueZ version"]["state"] == "skipped"


def test_a_robot_connected_already_is_pointed_out(doctor: Doctor) -> None:
    peripheral = robot()

    async def connect_and_leave() -> None:
        from dbus_fast import BusType, Message
        from dbus_fast.aio import MessageBus

        async with BleakScanner() as scanner:
            async for _ in scanner.advertisement_data():
                break
        bus = await MessageBus(bus_type=BusType.SYSTEM).connect()
        path = f"/org/bluez/hci0/dev_{ROBOT.replace(':', '_')}"
        call = Message(destination="org.bluez", path=path, interface="org.bluez.Device1", member="Connect")
        await bus.call(call)
        bus.disconnect()
        await bus.wait_for_disconnect()  # type: ignore[no-untyped-call] # dbus-fast leaves it without types

    with FakeBlueZ([peripheral]) as bluez, pytest.MonkeyPatch.context() as patch:
        patch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bluez.address)
        asyncio.run(connect_and_leave())
        page = doctor(bluez)
    assert page["robots in use"]["state"] == "warn"
    assert isinstance(peripheral.name, str)
    assert peripheral.name in page["robots in use"]["seen"]
    assert f"bluetoothctl disconnect {ROBOT}" in page["robots in use"]["fix"]
    assert "heard 0 devices" in page["scan"]["seen"]
    assert page.code == 0


@pytest.mark.parametrize("mtu", [23, 247])
def test_a_robot_over_bluetooth_is_measured(doctor: Doctor, mtu: int) -> None:
    peripheral = robot(mtu=mtu)
    with FakeBlueZ([peripheral]) as bluez:
        page = doctor(bluez, "-d", ROBOT)
    assert page.code == 0
    assert list(page)[-6:] == ROBOT_CHECKS
    seen = {name: page[name]["seen"] for name in ROBOT_CHECKS}
    assert isinstance(peripheral.name, str)
    assert seen["connection"].startswith(f"{peripheral.name}, Sphero BOLT, v2, connected in ")
    assert all(f"{step} " in seen["connection"] for step in ("scan", "connect", "handshake", "notify"))
    assert "V2 API" in seen["services"]
    assert seen["write size"] == f"{mtu - 3} bytes (MTU {mtu})"
    assert "40 of 40 echoes came back" in seen["round trips"]
    assert seen["firmware"].startswith("primary ")
    assert "battery voltage state" in seen["battery"]


def test_steps_are_told_when_asked_for(doctor: Doctor) -> None:
    with FakeBlueZ([robot()]) as bluez:
        page = doctor(bluez, "-d", ROBOT, "-v")
    assert page.err.splitlines()[:2] == ["scan ...", "connect ..."]


def test_a_robot_that_is_not_there(doctor: Doctor) -> None:
    with FakeBlueZ([]) as bluez:
        page = doctor(bluez, "-d", "BP-0000", "--connect-timeout", "0.2")
    assert page.fails() == ["connection"]
    assert "no robot 'BP-0000' was heard" in page["connection"]["seen"]
    assert "gave up after" in page["connection"]["seen"]
    assert "awake" in page["connection"]["fix"]
    assert page.skipped()[-5:] == ROBOT_CHECKS[1:]


def test_a_robot_that_drops_the_link(doctor: Doctor) -> None:
    with FakeBlueZ([robot(drop_at_write=10)]) as bluez:
        page = doctor(bluez, "-d", ROBOT)
    assert page.fails() == ["round trips"]
    assert page["firmware"]["seen"] == "the link was lost"
    assert "nearer" in page["round trips"]["fix"]


def test_a_fake_robot_makes_do_without_bluetooth(doctor: Doctor, here: Path) -> None:
    page = doctor(no_bus(here), "-d", "fake:bolt?latency=5ms")
    assert page.code == 0
    assert page["D-Bus"]["state"] == "warn"
    assert "40 of 40" in page["round trips"]["seen"]
    median = float(page["round trips"]["seen"].split()[1])
    assert median >= 5
    assert page["services"]["state"] == "skipped"


@pytest.mark.parametrize(
    ("address", "states"),
    [
        pytest.param("fake:ollie", {"firmware": "ok", "battery": "warn"}, id="v1"),
        pytest.param("fake:bolt?loss=0.1", {"round trips": "warn"}, id="lossy"),
        pytest.param("fake:bolt?latency=60ms", {"round trips": "warn"}, id="slow"),
        pytest.param(
            "fake:bolt?silent=0x10:0x00,0x13:0x0d",
            {"round trips": "fail", "firmware": "skipped", "battery": "skipped"},
            id="silent",
        ),
        pytest.param("fake:bolt?silent=0x13:0x17,0x13:0x03", {"battery": "skipped"}, id="battery-untold"),
    ],
)
def test_robots_of_all_sorts(address: str, states: dict[str, str]) -> None:
    looks: dict[str, Look] = {}
    run_on_virtual_clock(check_robot(looks.__setitem__, address, OpenOptions(), 0.1))
    assert list(looks) == ROBOT_CHECKS
    assert {name: looks[name].state for name in states} == states, looks


@pytest.mark.parametrize("address", ["fake:nobody", "serial:/no/such/port"])
def test_a_robot_behind_another_line_that_is_not_there(doctor: Doctor, here: Path, address: str) -> None:
    page = doctor(no_bus(here), "-d", address)
    assert page.fails() == ["connection"]
    assert page.skipped()[-5:] == ROBOT_CHECKS[1:]


def test_an_address_of_no_kind_is_a_usage_error(cli: Cli) -> None:
    ran = cli("doctor", "-d", "spooky:action")
    assert (ran.code, ran.out) == (2, "")


@pytest.mark.parametrize("columns", [20, 60, 80, 120])
def test_a_table_fits_and_says_every_state_in_words(
    cli: Cli, here: Path, monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", no_bus(here))
    monkeypatch.setenv("COLUMNS", str(columns))
    ran = cli("doctor", "--format", "table")
    assert ran.code == 1
    lines = ran.out.splitlines()
    assert max(map(len, lines)) <= max(60, columns)
    words = [line.split()[0] for line in lines[2:] if not line.startswith(" ")]
    assert " ".join(" ".join(line.split()) for line in lines).count("->") == 2
    assert words.count("fail") == 1
    assert set(words) == {"ok", "fail", "skipped"}


def test_plain_lines_have_name_state_seen_and_fix(
    cli: Cli, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", no_bus(here))
    rows = [line.split("\t") for line in cli("doctor").out.splitlines()]
    assert all(len(row) == 4 for row in rows)
    assert ["BlueZ", "skipped", "no D-Bus", ""] in rows


def test_another_system_has_no_bluez_but_a_scan(
    doctor: Doctor, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bluetooth_checks, "on_linux", lambda: False)
    page = doctor(no_bus(here))
    assert not {"D-Bus", "BlueZ version", "BlueZ", "adapter", "power", "radio switch"} & set(page)
    assert page.fails() == ["scan"]


def test_what_stumbles_is_a_line(doctor: Doctor, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stumble(*_: object) -> Look:
        raise ImportError("no such library")

    monkeypatch.setattr(checkup, "check_bluetooth", stumble)
    monkeypatch.setitem(machine_checks.SOFTWARE, "bleak", lambda: 1 / 0)
    page = doctor(no_bus(here), "-d", ROBOT)
    assert page.fails() == ["bleak", "bluetooth"]
    assert "division by zero" in page["bleak"]["seen"]
    assert "no such library" in page["bluetooth"]["seen"]
    assert page.skipped() == ROBOT_CHECKS


def test_serial_ports(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert machine_checks.serial_ports() == Look(State.OK, "none")
    (here / "ttyUSB0").touch()
    listed = [
        serial.ListedPort("COM3", ""),
        serial.ListedPort(str(here / "ttyUSB0"), "FTDI FT232R"),
        serial.ListedPort(str(here / "ttyUSB1"), ""),
    ]
    monkeypatch.setattr(serial, "ports", lambda: listed)
    assert machine_checks.serial_ports() == Look(
        State.OK, f"COM3, {here}/ttyUSB0 (FTDI FT232R), {here}/ttyUSB1"
    )
    monkeypatch.setattr(os, "access", lambda *_: False)
    denied = machine_checks.serial_ports()
    assert denied[:2] == (State.WARN, f"not allowed to use {here}/ttyUSB0")
    assert "dialout" in denied.fix


def test_ports_that_nothing_here_lists(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> list[serial.ListedPort]:
        raise UnavailableError("the serial ports cannot be listed: no sysfs", "name one")

    monkeypatch.setattr(serial, "ports", fail)
    assert machine_checks.serial_ports() == Look(State.SKIPPED, "the serial ports cannot be listed: no sysfs")


@pytest.mark.parametrize(
    ("check", "state"),
    [
        pytest.param(machine_checks.serial_library, State.WARN, id="serialx-is-optional"),
        pytest.param(machine_checks.bleak, State.FAIL, id="bleak-is-not"),
    ],
)
def test_libraries_that_are_not_installed(
    monkeypatch: pytest.MonkeyPatch, check: Callable[[], Look], state: State
) -> None:
    def version(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(machine_checks, "version", version)
    look = check()
    assert look.state is state
    assert "pip install" in look.fix


@pytest.mark.parametrize(
    ("found", "state"),
    [("3.0.2", State.OK), ("3.0.1", State.FAIL), ("4.0", State.FAIL), ("3.9.dev1", State.OK)],
)
def test_versions_of_bleak(monkeypatch: pytest.MonkeyPatch, found: str, state: State) -> None:
    monkeypatch.setattr(machine_checks, "version", lambda _: found)
    look = machine_checks.bleak()
    assert look.state is state
    assert state is State.OK or ">=3.0.2,<4" in look.fix


def test_a_version_of_serialx_that_does_not_fit_only_warns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_checks, "version", lambda _: "0.9")
    assert machine_checks.serial_library().state is State.WARN


def test_a_copy_that_was_never_installed_has_no_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(machine_checks, "metadata", missing)
    monkeypatch.setattr(machine_checks, "requires", missing)
    assert machine_checks.python().state is State.OK
    assert machine_checks.bleak().state is State.OK


def test_an_unknown_system_may_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.system", lambda: "Plan9")
    assert machine_checks.system().state is State.WARN


def test_an_old_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.python_version", lambda: "3.10.12")
    assert machine_checks.python().state is State.FAIL


@given(st.lists(st.integers(0, 99), min_size=1, max_size=4), st.integers(0, 3))
def test_a_version_is_within_its_own_bounds(numbers: list[int], zeros: int) -> None:
    text = ".".join(map(str, numbers))
    longer = text + ".0" * zeros
    assert machine_checks.within(longer, f">={text}")
    assert not machine_checks.within(longer, f"<{text}")
    assert machine_checks.within(text, f">={longer},<{numbers[0] + 1}")


class Screen(io.StringIO):
    """A terminal of an encoding."""

    def __init__(self, encoding: str) -> None:
        super().__init__()
        self._encoding = encoding

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return self._encoding

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("encoding", "columns", "term", "state", "said"),
    [
        pytest.param("utf-8", "80", "xterm", State.OK, "80 columns, utf-8, colour", id="usual"),
        pytest.param("utf-8", "40", "xterm", State.WARN, "40 columns", id="narrow"),
        pytest.param("ascii", "80", "xterm", State.WARN, "non-ASCII characters are escaped", id="ascii"),
        pytest.param("utf-8", "80", "dumb", State.OK, "no colour, TERM=dumb", id="dumb"),
    ],
)
def test_terminals(
    monkeypatch: pytest.MonkeyPatch, encoding: str, columns: str, term: str, state: State, said: str
) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setenv("TERM", term)
    look = machine_checks.terminal(Screen(encoding))
    assert look.state is state
    assert said in look.seen


def test_a_place_for_journals_is_looked_at_and_not_made(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(here / "new" / "state"))
    assert machine_checks.journal_folder().state is State.OK
    assert not (here / "new").exists()
    (here / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(here / "file"))
    look = machine_checks.journal_folder()
    assert (look.state, look.seen) == (State.FAIL, f"{here / 'file'} is not a folder")
    monkeypatch.setenv("XDG_STATE_HOME", str(here))
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "not allowed" in machine_checks.journal_folder().seen


def test_without_a_home_there_is_no_place_for_journals(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless(*_: object, **__: object) -> Path:
        raise RuntimeError("nobody knows the home")

    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setattr("platformdirs.user_state_path", homeless)
    look = machine_checks.journal_folder()
    assert look.state is State.FAIL
    assert "XDG_STATE_HOME" in look.fix


def test_round_trips_on_a_slow_line() -> None:
    async def measure() -> RoundTrips:
        async with open_transport(address_of("fake:mini?latency=40ms&sleep_after=1min")) as connection:
            policy = Policy(connection.generation, connection.robot, Consent(), ())
            async with Link(connection.transport, CODECS[connection.generation], policy) as link:
                return await measure_round_trips(link, None, 10)

    trips = run_on_virtual_clock(measure())
    assert (trips.sent, trips.lost) == (10, 0)
    assert 0.0399 < trips.times[0] <= trips.median <= trips.p95 <= 0.05


def test_steps_that_are_repeated_count_together() -> None:
    steps = Steps(lambda _: None)
    assert re.fullmatch(r"\d+\.\d\d s", steps.told())
    for step in ("scan", "connect", "connect, attempt 2: no answer", "notify"):
        steps.begin(step)
    assert re.findall("[a-z]{2,}", steps.told()) == ["scan", "connect", "notify"]


def test_round_trips_in_numbers() -> None:
    assert RoundTrips(20, tuple(range(1, 21))).p95 == 19
    assert RoundTrips(2, (1.0, 3.0)).median == 2
    assert RoundTrips(1, (1.0,)).p95 == 1
    assert math.isnan(RoundTrips(5, ()).p95)
    assert math.isnan(RoundTrips(5, ()).median)
