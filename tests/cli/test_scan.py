"""Scanning through unpatched bleak on the fake BlueZ: who is listed, who is watched, who is found."""

import asyncio
import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
from collections.abc import Callable, Coroutine, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import bleak
import pytest
from bleak.backends.device import BLEDevice
from bleak.backends.scanner import AdvertisementData

from sphero_probe.cli.complete.last_scan import recall
from sphero_probe.errors import RobotNotFoundError, UnavailableError
from sphero_probe.protocol.packets import Generation
from sphero_probe.transports.base import OpenOptions
from sphero_probe.transports.ble import choosing
from sphero_probe.transports.ble.scanner import Air, Heard, find, find_only, scan, watch
from tests.support import fake_bluez_scans
from tests.support.cli import Cli
from tests.support.fake_bluez import V2_SERVICE, Adapter, FakeBlueZ, Faults, Peripheral
from tests.support.fake_bluez_air import V1_SERVICE

PATIENCE = 20
"""Seconds for anything that takes one at most."""
ONE, TWO, THREE, FOUR = (f"AA:BB:CC:DD:EE:{number:02X}" for number in range(1, 5))
HOSTILE = "\x1b[2J\u202eBP-\t\"'<b>=1+1漢\u0301\u0301\u0301\u0301"
SHORT = OpenOptions(timeout=0.3)
LONG = OpenOptions(timeout=500)
TWO_ADAPTERS = (Adapter(), Adapter("hci1", address="00:1A:7D:DA:71:14"))

knows_who_is_connected = pytest.mark.skipif(
    not hasattr(bleak, "BleakAdapter"), reason="bleak before 3.1 does not tell who is connected"
)


pytestmark = pytest.mark.usefixtures("limited")
OnAir = Callable[..., AbstractContextManager[FakeBlueZ]]


@pytest.fixture
def air(monkeypatch: pytest.MonkeyPatch) -> OnAir:
    """Put robots on the air of this process."""

    @contextmanager
    def on_air(*peripherals: Peripheral, adapters: tuple[Adapter, ...] = (Adapter(),)) -> Iterator[FakeBlueZ]:
        with FakeBlueZ(peripherals, adapters=adapters) as bluez:
            monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bluez.address)
            yield bluez

    return on_air


def soon(work: Coroutine[Any, Any, Any]) -> Any:
    """Run it, and fail where it waits for the end of a long scan."""

    async def bounded() -> Any:
        async with asyncio.timeout(PATIENCE):
            return await work

    return asyncio.run(bounded())


# Who was heard


def heard(name: str | None, address: str = ONE, rssi: int = -50, *services: str, path: str = "hci0") -> Any:
    data = AdvertisementData(name, {}, {}, list(services), None, rssi, ())
    return BLEDevice(address, name, {"path": path}), data


def names_in(air: Air) -> list[tuple[str, int | None]]:
    return [(one.seen.name, one.seen.rssi) for one in air.around()]


def test_one_address_is_one_robot_however_it_is_written_and_wherever_it_is_heard() -> None:
    air = Air()
    air.hear(*heard("BP-1234", ONE, -70, path="hci0"))
    air.hear(*heard("BP-1234", ONE.lower(), -40, path="hci1"))
    assert names_in(air) == [("BP-1234", -40)]


def test_the_latest_name_counts_and_an_empty_one_does_not() -> None:
    air = Air()
    for name in ("BP-1234", None, "BP-9999", ""):
        air.hear(*heard(name))
    assert names_in(air) == [("BP-9999", -50)]


def test_services_once_offered_are_remembered() -> None:
    air = Air()
    air.hear(*heard("Fred", ONE, -50, V1_SERVICE.upper()))
    air.hear(*heard("Fred", ONE, -51))
    assert [one.seen.generation for one in air.around()] == [Generation.V1]


def test_what_bluez_only_remembers_is_not_heard() -> None:
    told: list[Heard] = []
    air = Air(told.append)
    air.hear(*heard("BP-1234", ONE, -127))
    assert (air.around(), told) == ([], [])


def test_an_unknown_strength_is_told_as_such_and_listed_last() -> None:
    air = Air()
    air.hear(*heard("BP-1", ONE, 127))
    air.hear(*heard("BP-2", TWO, -90))
    assert names_in(air) == [("BP-2", -90), ("BP-1", None)]


def test_a_connected_robot_that_is_heard_too_is_one_robot() -> None:
    air = Air()
    device, data = heard(None, ONE, -60)
    air.hear(device, data)
    air.meet([Heard(heard_seen("BP-1234", ONE), device)])
    (merged,) = air.around()
    assert (merged.seen.name, merged.seen.rssi, merged.seen.connected) == ("BP-1234", -60, True)
    air.meet([])
    assert not air.around()[0].seen.connected


def heard_seen(name: str, address: str) -> Any:
    from sphero_probe.transports.base import Seen

    return Seen(name, None, address, None, connected=True)


# scan


@knows_who_is_connected
def test_scan_lists_spheros_by_name_and_by_service_and_those_connected_here(cli: Cli, air: OnAir) -> None:
    robots = [
        Peripheral("BP-1234", ONE, rssi=-40),
        Peripheral("Fred", TWO, rssi=-60, uuids=(V2_SERVICE,)),
        Peripheral("SM-5678", THREE),
        Peripheral("Kettle", FOUR),
    ]
    with air(*robots) as bluez:
        bluez.hold(robots[2])
        ran = cli("scan", "--timeout", "0.3", "--format", "jsonl")
        table = cli("scan", "--timeout", "0.3", "--format", "table")
    rows = [json.loads(line) for line in ran.out.splitlines()]
    assert [list(row) for row in rows] == [
        ["type", "schema_version", "name", "model", "generation", "address", "rssi"],
        ["type", "name", "model", "generation", "address", "rssi"],
        ["type", "name", "model", "generation", "address", "rssi", "connected"],
    ]
    assert [list(row.values())[-5:] for row in rows[:2]] == [
        ["BP-1234", "Sphero BOLT+", "v2", ONE, -40],
        ["Fred", "unknown Sphero", "v2", TWO, -60],
    ]
    assert list(rows[2].values())[1:] == ["SM-5678", "Sphero Mini", "v2", THREE, None, True]
    assert table.out.splitlines()[-1].split("  ")[-1].strip() == "connected to this machine"
    assert (ran.code, ran.err) == (0, "")
    assert [robot.name for robot in recall()] == ["BP-1234", "Fred", "SM-5678"]


def test_scan_leaves_out_a_robot_that_bluez_only_remembers(cli: Cli, air: OnAir) -> None:
    asleep = Peripheral("BP-1234", ONE, faults=Faults(asleep=True))
    with air(asleep, Peripheral("SB-0001", TWO)):
        ran = cli("scan", "--timeout", "0.3", "--all")
    assert [line.split("\t")[0] for line in ran.out.splitlines()] == ["SB-0001"]


def test_scan_lists_a_robot_in_range_of_two_adapters_once(cli: Cli, air: OnAir) -> None:
    with air(Peripheral("BP-1234", ONE), adapters=TWO_ADAPTERS) as bluez:
        ran = cli("scan", "--timeout", "0.3")
        other = cli("scan", "--timeout", "0.3", "--adapter", "hci1")
        assert bluez.called("StartDiscovery")[-1].path.endswith("hci1")
    assert ran.out == other.out == f"BP-1234\tSphero BOLT+\tv2\t{ONE}\t-50\n"


def test_scan_keeps_up_with_two_hundred_neighbours_with_hostile_names(
    cli: Cli, air: OnAir, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fake_bluez_scans, "ADVERTISING_SECONDS", 0.1)
    crowd = [
        Peripheral(f"{HOSTILE}{number}" + "x" * number, f"AA:BB:CC:DD:{number >> 8:02X}:{number & 255:02X}")
        for number in range(200)
    ]
    with air(*crowd, Peripheral(None, "00:00:00:00:00:01"), Peripheral("BP-1234", "00:00:00:00:00:02")):
        everyone = cli("scan", "--timeout", "0.6", "--all")
        robots = cli("scan", "--timeout", "0.3")
    assert (everyone.code, robots.code) == (0, 0)
    assert len(everyone.out.splitlines()) == 202
    assert robots.out.startswith("BP-1234\t")
    assert len(robots.out.splitlines()) == 1
    assert re.fullmatch(r"[\t\n -~漢\u0301]*", everyone.out)
    assert r"\x1b[2J\u202eBP-\t" in everyone.out


@pytest.mark.parametrize(
    ("pattern", "names", "said"),
    [
        pytest.param("bp-*", ["BP-1234"], "", id="some"),
        pytest.param("*-000?", ["SB-0001"], "", id="one-sign"),
        pytest.param(
            "RV-*", [], "2 robots were found, but no name matches 'RV-*'\n", id="none-of-those-heard"
        ),
    ],
)
def test_scan_by_name(cli: Cli, air: OnAir, pattern: str, names: list[str], said: str) -> None:
    with air(Peripheral("BP-1234", ONE), Peripheral("SB-0001", TWO)):
        ran = cli("scan", "--timeout", "0.2", "--name", pattern)
    assert [line.split("\t")[0] for line in ran.out.splitlines()] == names
    assert (ran.code, ran.err) == (0, said)


def test_scan_of_an_empty_room_names_the_likely_reasons(cli: Cli, air: OnAir) -> None:
    with air():
        ran = cli("scan", "--timeout", "0.2", "--json")
    assert (ran.code, json.loads(ran.out)) == (0, [])
    assert "no robot was heard within 0.2 s" in ran.err
    assert all(reason in ran.err for reason in ("shake it", "in range and charged", "phone"))


def test_every_advertisement_is_asked_for(air: OnAir) -> None:
    with air() as bluez:
        soon(scan(OpenOptions(timeout=0.1)))
        assert bluez.called("SetDiscoveryFilter")[0].body[0]["DuplicateData"].value is True


# watch


@knows_who_is_connected
def test_watch_tells_of_each_once_and_of_those_connected_then_ends(
    cli: Cli, air: OnAir, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sphero_probe.transports.ble.scanner._LOOK", 0.1)
    known, held = Peripheral("BP-1234", ONE), Peripheral("SM-5678", TWO)
    with air(known, held, Peripheral("Kettle", THREE)) as bluez:
        bluez.hold(held)
        ran = cli("scan", "--watch", "--timeout", "0.4", "--format", "jsonl", "--name", "[BKS]*")
    rows = [json.loads(line) for line in ran.out.splitlines()]
    assert sorted((row["name"], row["rssi"], row.get("connected")) for row in rows) == [
        ("BP-1234", -50, None),
        ("SM-5678", None, True),
    ]
    assert (ran.code, ran.err) == (0, "")
    assert [robot.name for robot in recall()] == ["BP-1234", "SM-5678"]


def test_watch_writes_a_table_to_a_file_at_the_end(cli: Cli, air: OnAir, tmp_path: Path) -> None:
    with air(Peripheral("BP-1234", ONE)):
        ran = cli("scan", "--watch", "--timeout", "0.2", "--output", str(tmp_path / "robots.txt"))
    assert (ran.code, ran.out) == (0, "")
    assert (tmp_path / "robots.txt").read_text("utf-8").splitlines()[2].split()[0] == "BP-1234"


def test_watch_in_an_empty_room_says_so(cli: Cli, air: OnAir) -> None:
    with air():
        ran = cli("scan", "--watch", "--timeout", "0.1", "--format", "csv")
    assert (ran.code, ran.out) == (0, "name,model,generation,address,rssi\n")
    assert "no robot was heard" in ran.err


@knows_who_is_connected
def test_watch_ends_when_bluetooth_is_switched_off(air: OnAir, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sphero_probe.transports.ble.scanner._LOOK", 0.1)
    with air(Peripheral("BP-1234", ONE)) as bluez:

        async def switch_off() -> None:
            heard = asyncio.Event()
            watching = asyncio.create_task(watch(LONG, lambda _: heard.set()))
            await heard.wait()
            await asyncio.to_thread(bluez.power, on=False)
            await watching

        with pytest.raises(UnavailableError, match="switched off"):
            soon(switch_off())


COMMAND = [sys.executable, "-m", "sphero_probe", "scan", "--watch"]


def test_watch_in_a_pipe_tells_at_once_and_ends_politely(air: OnAir) -> None:
    def next_name() -> str:
        assert running.stdout
        assert select.select([running.stdout], [], [], PATIENCE)[0], "nothing was told"
        return str(json.loads(running.stdout.readline())["name"])

    with air(Peripheral("BP-1234", ONE)) as bluez:
        environment = {**os.environ, "PYTHONUNBUFFERED": ""}
        command = [*COMMAND, "--format", "jsonl"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as running:
            try:
                assert next_name() == "BP-1234"
                bluez.add(Peripheral("SB-0001", TWO))
                assert next_name() == "SB-0001"
            finally:
                running.send_signal(signal.SIGINT)
            assert running.communicate(timeout=PATIENCE)[0] == ""
            assert running.returncode == 130
        assert len(bluez.called("StopDiscovery")) == 1


def screen_of(out: bytes, lines: int = 24) -> list[str]:
    """Return what a terminal shows after this output, as far as a live table makes use of one."""
    rows, row, column = [""] * lines, 0, 0
    for part in re.findall(r"\x1b\[[?0-9;]*[A-Za-z]|\r|\n|[^\x1b\r\n]+", out.decode()):
        if part == "\r":
            column = 0
        elif part == "\n":
            row += 1
            assert row < lines, "the screen scrolled"
        elif part.startswith("\x1b"):
            if part.endswith("A"):
                row -= int(part[2:-1])
            elif part.endswith("K"):
                rows[row] = ""
        else:
            rows[row] = rows[row].ljust(column)[:column] + part + rows[row][column + len(part) :]
            column += len(part)
    return [line.rstrip() for line in rows]


def test_watch_on_a_terminal_shows_a_table_that_stays_in_place(
    air: OnAir, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fake_bluez_scans, "ADVERTISING_SECONDS", 0.1)
    crowd = [Peripheral(f"RV-{number:04}", f"AA:BB:CC:DD:00:{number:02X}") for number in range(30)]
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    environment = {**os.environ, "TERM": "xterm", "PYTHONUTF8": "1"}
    for name in ("COLUMNS", "LINES", "FORCE_COLOR", "NO_COLOR"):
        environment.pop(name, None)
    out = b""
    with air(Peripheral("BP-1234", ONE), *crowd) as bluez:
        environment["DBUS_SYSTEM_BUS_ADDRESS"] = bluez.address
        running = subprocess.Popen(COMMAND, stdout=theirs, stderr=theirs, stdin=theirs, env=environment)
        os.close(theirs)
        for awaited in (b"31 near", b"BP-1235"):
            while awaited not in out:
                assert select.select([ours], [], [], PATIENCE)[0], out
                out += os.read(ours, 4096)
            if awaited == b"31 near":
                bluez.add(Peripheral("BP-1235", TWO))
        running.send_signal(signal.SIGINT)
        try:
            while more := os.read(ours, 4096):
                out += more
        except OSError:  # Linux: nobody holds the other end any more
            pass
        assert running.wait(PATIENCE) == 130
    os.close(ours)
    lines = screen_of(out)
    assert lines[0].split() == ["Name", "Model", "Protocol", "Address", "dBm", "Heard"]
    assert lines[2].split()[:6] == ["BP-1234", "Sphero", "BOLT+", "v2", ONE, "-50"]
    assert lines[3].startswith("BP-1235")
    assert lines[22] == "32 near, 12 not shown"
    assert max(map(len, lines)) <= 80
    assert lines[23] == ""
    assert out.count(b"\x1b[?25l") == out.count(b"\x1b[?25h") == 1


# find


def test_an_address_is_found_at_once(air: OnAir) -> None:
    with air(Peripheral("BP-1234", ONE), Peripheral("BP-1299", TWO)):
        assert soon(find(TWO.lower(), LONG)).seen.name == "BP-1299"


@pytest.mark.parametrize("name", ["BP-1234", "bp-1234"])
def test_a_name_is_found_soon(air: OnAir, name: str) -> None:
    with air(Peripheral("BP-1234", ONE), Peripheral("BP-12345", TWO)):
        assert soon(find(name, LONG)).seen.address == ONE


def test_a_beginning_and_the_only_robot_are_found_in_the_time_there_is(air: OnAir) -> None:
    with air(Peripheral("BP-1234", ONE), Peripheral("Kettle", TWO)):
        assert soon(find("bp", SHORT)).seen.address == ONE
        assert soon(find_only(SHORT)).seen.address == ONE


def test_a_shared_name_is_nobodys(air: OnAir) -> None:
    with (
        air(Peripheral("BP-1234", ONE), Peripheral("BP-1234", TWO)),
        pytest.raises(RobotNotFoundError, match="2 robots are called BP-1234"),
    ):
        soon(find("BP-1234", LONG))


def test_a_robot_that_appears_later_is_found(air: OnAir) -> None:
    with air(Peripheral("BP-1234", ONE)) as bluez:

        async def wake_up_meanwhile() -> Heard:
            finding = asyncio.create_task(find("SB-0001", LONG))
            await asyncio.to_thread(bluez.add, Peripheral("SB-0001", TWO))
            return await finding

        assert soon(wake_up_meanwhile()).seen.address == TWO


@knows_who_is_connected
@pytest.mark.parametrize("wanted", ["BP-1234", ONE, "bp", ""])
def test_a_robot_in_use_is_not_taken_and_not_waited_for(
    air: OnAir, monkeypatch: pytest.MonkeyPatch, wanted: str
) -> None:
    monkeypatch.setattr(choosing, "SETTLING", 0.1)
    held = Peripheral("BP-1234", ONE)
    with air(held) as bluez:
        bluez.hold(held)
        with pytest.raises(RobotNotFoundError, match="BP-1234 is connected to this machine already"):
            soon(find(wanted, LONG))
        assert not bluez.called("Connect")


def test_a_robot_that_bluez_only_remembers_is_not_found(air: OnAir) -> None:
    with (
        air(Peripheral("BP-1234", ONE, faults=Faults(asleep=True))),
        pytest.raises(RobotNotFoundError, match=r"no robot 'BP-1234' was heard within 0\.3 s$"),
    ):
        soon(find("BP-1234", SHORT))


def test_the_command_line_says_whom_it_heard_instead(cli: Cli, air: OnAir) -> None:
    with air(Peripheral("BP-1234", ONE), Peripheral(HOSTILE, TWO, uuids=(V1_SERVICE,))):
        ran = cli("info", "--device", "XX", "--connect-timeout", "0.3")
    first, hint = ran.err.splitlines()
    assert ran.code == 3
    assert first.startswith("sphero-probe: no robot 'XX' was heard within 0.3 s; heard: ")
    assert "BP-1234" in first
    assert r"\x1b[2J\u202eBP-\t" in first
    assert "shake it" in hint
