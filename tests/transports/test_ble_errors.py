"""Every way in which Bluetooth can be missing or fail, turned into one line, a hint and an exit code."""

import asyncio
import os
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from bleak.exc import (
    BleakBluetoothNotAvailableError,
    BleakBluetoothNotAvailableReason,
    BleakCharacteristicNotFoundError,
    BleakDBusError,
    BleakDeviceNotFoundError,
    BleakError,
    BleakGATTProtocolError,
)
from dbus_fast.errors import AuthError, DBusFastError, InvalidAddressError
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.catalogue.gatt import API_SERVICE, V1_CONTROL_SERVICE
from sphero_probe.catalogue.gatt_services import list_services
from sphero_probe.errors import (
    ConnectionFailedError,
    LastingFailureError,
    LinkLostError,
    NoSuchAdapterError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
)
from sphero_probe.transports.ble.explain import explain, step
from tests.support.cli import Cli
from tests.support.fake_bluez import ACCESS_DENIED, CHILD_EXITED, Adapter, BusFaults, Faults
from tests.support.fake_bluez_stage import ADDRESS, PATIENCE, Stage, limit, said

Reason = BleakBluetoothNotAvailableReason
SCAN = ("scan", "--timeout", "0.2")
INFO = ("info", "-d", ADDRESS, "--connect-timeout", "0.2")
FAILED = "org.bluez.Error.Failed"
PLATFORMS = ("linux", "darwin", "win32")
STEPS = ("scan", "connect", "services", "handshake", "notify", "write")


@contextmanager
def socket_file() -> Iterator[Path]:
    """A place for a socket; pytest's own are too long for one."""
    with TemporaryDirectory(prefix="bus-") as folder:
        yield Path(folder) / "bus"


@pytest.mark.parametrize("command", [SCAN, INFO], ids=["scan", "info"])
@pytest.mark.parametrize(
    ("address", "text"),
    [
        pytest.param("unix:path=/no/such/socket", "no system bus", id="no-socket"),
        pytest.param("unix:abstract=nobody-listens-here", "no system bus", id="no-abstract-socket"),
        pytest.param("nonsense", "the address of the system bus makes no sense", id="no-address"),
        pytest.param("foo:bar=1", "the address of the system bus makes no sense", id="unknown-transport"),
        pytest.param("unix:", "the address of the system bus makes no sense", id="no-path"),
        pytest.param("unix:path=/" + "x" * 200, "AF_UNIX path too long", id="path-too-long"),
        pytest.param("unix:path=", "Invalid argument", id="empty-path"),
    ],
)
def test_no_bus(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...], address: str, text: str
) -> None:
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)
    with limit(PATIENCE):
        ran = cli(*command)
    said(ran, text, code=9)


def test_a_socket_that_nobody_listens_at(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket_file() as path, limit(PATIENCE):
        with socket.socket(socket.AF_UNIX) as dead:
            dead.bind(str(path))
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", f"unix:path={path}")
        ran = cli(*SCAN)
    said(ran, "no system bus", code=9)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="permissions do not stop root")
def test_a_socket_that_this_user_may_not_use(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket_file() as path, socket.socket(socket.AF_UNIX) as closed, limit(PATIENCE):
        closed.bind(str(path))
        closed.listen()
        path.chmod(0)
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", f"unix:path={path}")
        ran = cli(*SCAN)
    said(ran, "the system bus refuses this user", code=9)


@pytest.mark.parametrize("command", [SCAN, INFO], ids=["scan", "info"])
@pytest.mark.parametrize(
    ("faults", "adapters", "text", "hint"),
    [
        pytest.param(
            {"rejects_authentication": True},
            (Adapter(),),
            "the system denies Bluetooth to this program",
            "BLEAK_DBUS_AUTH_UID",
            id="authentication-rejected",
        ),
        pytest.param(
            {"errors": {"*": ACCESS_DENIED}},
            (Adapter(),),
            "access to Bluetooth is denied",
            "group bluetooth",
            id="policy",
        ),
        pytest.param(
            {"absent": True}, (Adapter(),), "BlueZ is not running", "apt install bluez", id="no-bluez"
        ),
        pytest.param(
            {"errors": {"*": CHILD_EXITED}},
            (Adapter(),),
            "BlueZ does not start",
            "systemctl status bluetooth",
            id="bluez-does-not-start",
        ),
        pytest.param({}, (), "no Bluetooth adapter", "--device fake:bolt-plus", id="no-adapter"),
        pytest.param(
            {}, (Adapter(powered=False),), "switched off", "bluetoothctl power on", id="adapter-off"
        ),
        pytest.param({}, (Adapter(roles=("peripheral",)),), "cannot connect to", "plug in", id="not-central"),
        pytest.param(
            {"hangs_up_at": "GetManagedObjects"},
            (Adapter(),),
            "D-Bus broke",
            "try again",
            id="bus-dies-at-once",
        ),
        pytest.param(
            {"hangs_up_at": "StartDiscovery"},
            (Adapter(),),
            "D-Bus broke",
            "try again",
            id="bus-dies-in-a-scan",
        ),
        pytest.param(
            {"errors": {"StartDiscovery": ("org.bluez.Error.InProgress", "Operation already in progress")}},
            (Adapter(),),
            "BlueZ is busy",
            "close what else uses Bluetooth",
            id="busy",
        ),
        pytest.param(
            {"errors": {"StartDiscovery": ("org.bluez.Error.NotReady", "Resource Not Ready")}},
            (Adapter(),),
            "adapter is switched off",
            "rfkill unblock bluetooth",
            id="switched-off-meanwhile",
        ),
    ],
)
def test_a_machine_that_is_not_ready(
    stage: Stage,
    command: tuple[str, ...],
    faults: dict[str, Any],
    adapters: tuple[Adapter],
    text: str,
    hint: str,
) -> None:
    ran = stage.run([stage.robot()], *command, adapters=adapters, faults=BusFaults(**faults))
    said(ran, text, code=9)
    assert hint in ran.err.splitlines()[1]
    assert not stage.bluez.called("Connect")


@pytest.mark.parametrize("member", ["Connect", "WriteValue", "StartNotify"])
def test_a_bus_that_dies_while_connecting(stage: Stage, member: str) -> None:
    ran = stage.run([stage.robot("bolt", gate=True)], *INFO, faults=BusFaults(hangs_up_at=member))
    said(ran, "the connection to D-Bus broke", code=9)


@pytest.mark.parametrize(
    ("command", "adapters", "text", "hint"),
    [
        pytest.param(
            SCAN,
            (Adapter(powered=False), Adapter("hci1")),
            "there is no Bluetooth adapter hci7",
            "there are: hci0 (off), hci1; choose one with --adapter hci1",
            id="scan",
        ),
        pytest.param(INFO, (Adapter(),), "there is no Bluetooth adapter hci7", "there are: hci0;", id="info"),
        pytest.param(INFO, (), "no Bluetooth adapter", "plug one in", id="none-at-all"),
    ],
)
def test_a_wrong_adapter_is_told_with_those_there_are(
    stage: Stage, command: tuple[str, ...], adapters: tuple[Adapter, ...], text: str, hint: str
) -> None:
    ran = stage.run([stage.robot()], *command, "--adapter", "hci7", adapters=adapters)
    said(ran, text, code=9)
    assert hint in ran.err.splitlines()[1]


def test_an_adapter_that_is_off_is_not_the_robots_fault(stage: Stage) -> None:
    off = (Adapter(), Adapter("hci1", powered=False))
    ran = stage.run([stage.robot()], *INFO, "--adapter", "hci1", adapters=off)
    said(ran, "the Bluetooth adapter is switched off", code=9)


def test_an_address_that_nobody_has(stage: Stage) -> None:
    ran = stage.run([stage.robot()], "info", "-d", "AA:BB:CC:DD:EE:99", "--connect-timeout", "0.2")
    said(ran, "AA:BB:CC:DD:EE:99", code=3)
    assert "is it awake" in ran.err


@pytest.mark.parametrize("command", [SCAN, INFO], ids=["scan", "info"])
@pytest.mark.parametrize(
    "faults",
    [{"mute": True}, {"unanswered": frozenset({"*"})}, {"unanswered": frozenset({"StartDiscovery"})}],
    ids=["bus", "bluez", "scan"],
)
def test_a_bus_that_never_answers(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...], faults: dict[str, Any]
) -> None:
    monkeypatch.setattr("sphero_probe.transports.ble.scanner.GRACE", 0.1)
    ran = stage.run([stage.robot()], *command, faults=BusFaults(**faults))
    said(ran, "the Bluetooth service does not answer", code=9)


def test_a_bluez_that_falls_silent_while_connecting(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sphero_probe.transports.ble.connection.PATIENCE", 0.1)
    silent = BusFaults(unanswered=frozenset({"Connect", "Disconnect"}))
    ran = stage.run([stage.robot()], *INFO, faults=silent)
    said(ran, "connect: the Bluetooth service does not answer", code=9)


@pytest.mark.parametrize("member", ["WriteValue", "StartNotify"])
def test_a_call_without_a_reply_is_bounded(stage: Stage, member: str) -> None:
    silent = BusFaults(unanswered=frozenset({member}))
    ran = stage.run([stage.robot("bolt", gate=True)], *INFO, faults=silent)
    said(ran, "no answer in time; it has: Sphero V2 gate, Sphero V2 API (3 attempts", code=4)


def test_a_hostile_reason_is_bounded_and_harmless(stage: Stage) -> None:
    robot = stage.robot(faults=Faults(connect_errors=("\x1b[31m" + "x" * 4000,) * 3))
    ran = stage.run([robot], *INFO)
    said(ran, "connect: ", code=4)
    assert "\x1b" not in ran.err


def errors_of_bleak() -> Iterator[Any]:
    """What bleak raises on any system, and what becomes of it: error, step, platform, kind, texts."""
    error: Exception
    off, no, denied = "switched off", "no Bluetooth adapter", "denie"
    for reason, platform, *texts in (
        (Reason.NO_BLUETOOTH, "darwin", no, "fake:bolt-plus"),
        (Reason.NO_BLUETOOTH, "win32", no, "plug one in"),
        (Reason.NO_BLE_CENTRAL_ROLE, "win32", "cannot connect", "plug in one"),
        (Reason.POWERED_OFF, "linux", off, "bluetoothctl power on"),
        (Reason.POWERED_OFF, "darwin", off, "System Settings"),
        (Reason.POWERED_OFF, "win32", off, "Settings > Bluetooth"),
        (Reason.DENIED_BY_USER, "darwin", denied, "Privacy & Security > Bluetooth"),
        (Reason.DENIED_BY_SYSTEM, "darwin", denied, "restriction"),
        (Reason.DENIED_BY_SYSTEM, "linux", denied, "BLEAK_DBUS_AUTH_UID"),
        (Reason.DENIED_BY_UNKNOWN, "darwin", denied, "Privacy & Security > Bluetooth"),
        (Reason.UNKNOWN, "darwin", "does not tell", "off and on"),
        (Reason.UNKNOWN, "win32", "does not tell", "off and on"),
    ):
        error = BleakBluetoothNotAvailableError("as the backend says", reason)
        yield pytest.param(error, "scan", platform, UnavailableError, texts, id=f"{reason.name}-{platform}")
    for text, doing, platform, kind, *texts in (
        (
            "failed to connect: Error Domain=CBErrorDomain",
            "connect",
            "darwin",
            ConnectionFailedError,
            "connect: ",
        ),
        ("Failed to discover services Error", "connect", "darwin", ConnectionFailedError, "services: "),
        (
            "Could not get GATT services: Unreachable",
            "connect",
            "win32",
            ConnectionFailedError,
            "services: the ",
        ),
        (
            "Could not write value: Access Denied",
            "handshake",
            "win32",
            ConnectionFailedError,
            "denies",
            "remove",
        ),
        ("device does not support GATT sessions", "connect", "win32", ConnectionFailedError, "GATT sessions"),
        ("Failed to start scanner. Is Bluetooth turned on?", "scan", "win32", UnavailableError, "turned on?"),
        ("disconnected", "notify", "darwin", ConnectionFailedError, "notify: the robot dropped the link"),
        ("Not connected", "write", "linux", ConnectionFailedError, "write: the robot dropped the link"),
        ("Service Discovery has not been performed yet", "write", "linux", ConnectionFailedError, "dropped"),
        (
            "failed to discover services, device disconnected",
            "connect",
            "linux",
            ConnectionFailedError,
            "services:",
        ),
        ("device 'dev_AA_BB' not found", "connect", "linux", RobotNotFoundError, "not there any more"),
        ("adapter 'hci7' not found", "scan", "linux", UnavailableError, "hci7"),
        ("Bleak requires BlueZ >= 5.55.", "connect", "linux", UnavailableError, "too old", "5.55"),
    ):
        yield pytest.param(BleakError(text), doing, platform, kind, texts, id=f"{platform}-{text[:30]}")
    gone = BleakDeviceNotFoundError("AA:BB", "Device with address AA:BB was not found.")
    for name, error, doing, kind, *texts in (
        ("gone", gone, "connect", RobotNotFoundError, "not there any more", "awake"),
        (
            "gone-wordless",
            BleakDeviceNotFoundError("AA:BB"),
            "connect",
            RobotNotFoundError,
            "not there any more",
        ),
        ("wordless", BleakError(), "notify", ConnectionFailedError, "notify: BleakError"),
        (
            "no-characteristic",
            BleakCharacteristicNotFoundError(7),
            "notify",
            ConnectionFailedError,
            "7 was not found",
        ),
        ("time-out", TimeoutError(), "connect", ConnectionFailedError, "connect: no answer in time", "awake"),
        (
            "unresolved",
            TimeoutError(),
            "services",
            ConnectionFailedError,
            "services: ",
            "bluetoothctl remove",
        ),
        ("no-answer-scanning", TimeoutError(), "scan", UnavailableError, "does not answer", "restart"),
        (
            "no-permission",
            PermissionError(13, "Permission denied"),
            "scan",
            UnavailableError,
            "group bluetooth",
        ),
        (
            "no-file",
            FileNotFoundError(2, "No such file"),
            "scan",
            UnavailableError,
            "no system bus",
            "container",
        ),
        ("no-listener", ConnectionRefusedError(111, "refused"), "scan", UnavailableError, "no system bus"),
        ("bus-dies", EOFError(), "connect", UnavailableError, "D-Bus broke", "try again"),
        ("bus-dies-reading", asyncio.IncompleteReadError(b"", 16), "write", UnavailableError, "D-Bus broke"),
        ("bus-resets", ConnectionResetError(104, "reset"), "notify", UnavailableError, "D-Bus broke"),
        ("bus-pipe", BrokenPipeError(32, "Broken pipe"), "notify", UnavailableError, "D-Bus broke"),
        ("address", InvalidAddressError("x"), "scan", UnavailableError, "makes no sense", "DBUS_SYSTEM_BUS"),
        (
            "authentication",
            AuthError("rejected"),
            "connect",
            UnavailableError,
            "denies",
            "BLEAK_DBUS_AUTH_UID",
        ),
        ("dbus", DBusFastError("odd"), "scan", UnavailableError, "odd"),
        ("said-already", LinkLostError("gone", "hint"), "write", LinkLostError, "gone", "hint"),
    ):
        yield pytest.param(error, doing, "linux", kind, texts, id=name)
    closed = OSError(22, "The object has been closed")
    yield pytest.param(
        closed, "connect", "win32", ConnectionFailedError, ["connect: The object"], id="winerror"
    )


@pytest.mark.parametrize(("error", "doing", "platform", "kind", "texts"), list(errors_of_bleak()))
def test_each_error_of_bleak_has_words(
    error: AuthError
    | BleakBluetoothNotAvailableError
    | BleakCharacteristicNotFoundError
    | BleakDeviceNotFoundError
    | BleakError
    | BrokenPipeError
    | ConnectionRefusedError
    | ConnectionResetError
    | DBusFastError
    | EOFError
    | FileNotFoundError
    | InvalidAddressError
    | LinkLostError
    | OSError
    | PermissionError
    | TimeoutError
    | asyncio.IncompleteReadError,
    doing: str,
    platform: str,
    kind: type[ConnectionFailedError]
    | type[LinkLostError]
    | type[RobotNotFoundError]
    | type[UnavailableError],
    texts: list[str],
) -> None:
    told = explain(error, doing, platform)
    assert isinstance(told, kind)
    for text in texts:
        assert text in f"{told}\n{told.hint}"
    assert told.hint


@pytest.mark.parametrize(
    ("name", "details", "doing", "kind", "text"),
    [
        pytest.param(
            "org.freedesktop.DBus.Error.AccessDenied", "", "scan", UnavailableError, "denied", id="denied"
        ),
        pytest.param(
            "org.freedesktop.DBus.Error.ServiceUnknown", "", "scan", UnavailableError, "not running", id="no"
        ),
        pytest.param(
            "org.freedesktop.DBus.Error.Spawn.ExecFailed", "", "scan", UnavailableError, "start", id="spawn"
        ),
        pytest.param("org.freedesktop.systemd1.NoSuchUnit", "", "scan", UnavailableError, "start", id="unit"),
        pytest.param(
            "org.freedesktop.DBus.Error.NoReply", "", "connect", UnavailableError, "answer", id="no-reply"
        ),
        pytest.param(
            "org.freedesktop.DBus.Error.TimedOut", "", "scan", UnavailableError, "answer", id="timed-out"
        ),
        pytest.param(
            "org.freedesktop.DBus.Error.UnknownObject", "", "notify", RobotNotFoundError, "there", id="gone"
        ),
        pytest.param(
            "org.bluez.Error.AuthenticationFailed", "", "connect", LastingFailureError, "pairing", id="auth"
        ),
        pytest.param(
            "org.bluez.Error.NotPermitted", "Not paired", "handshake", LastingFailureError, "pairing", id="np"
        ),
        pytest.param("org.bluez.Error.InProgress", "", "connect", ConnectionFailedError, "busy", id="busy"),
        pytest.param(
            FAILED, "Not connected", "write", ConnectionFailedError, "write: the robot dropped", id="drop"
        ),
        pytest.param(
            FAILED, "Host is down", "connect", ConnectionFailedError, "connect: no answer", id="down"
        ),
        pytest.param(
            FAILED, "br-connection-unknown", "connect", ConnectionFailedError, "connect: br-", id="other"
        ),
        pytest.param(FAILED, "", "connect", ConnectionFailedError, FAILED, id="wordless"),
        pytest.param(
            "Weird", "ATT error: 0xno number", "notify", ConnectionFailedError, "no number", id="not-hex"
        ),
    ],
)
def test_each_error_of_the_bus_has_words(
    name: str,
    details: str,
    doing: str,
    kind: type[ConnectionFailedError]
    | type[LastingFailureError]
    | type[RobotNotFoundError]
    | type[UnavailableError],
    text: str,
) -> None:
    told = explain(BleakDBusError(name, [details] if details else []), doing, "linux")
    assert isinstance(told, kind)
    assert text in str(told)
    assert told.hint


@pytest.mark.parametrize("platform", PLATFORMS)
def test_each_reason_has_words_of_its_own(platform: str) -> None:
    told = [str(explain(BleakBluetoothNotAvailableError("", reason), "scan", platform)) for reason in Reason]
    assert len(set(told)) == len(Reason)


@pytest.mark.parametrize(
    ("code", "platform", "texts"),
    [
        (0x03, "linux", ("ATT error 0x03, write not permitted", "please report it")),
        (0x05, "linux", ("ATT error 0x05, insufficient authentication", "bluetoothctl remove")),
        (0x05, "darwin", ("insufficient authentication", "forget the robot in System Settings")),
        (0x0F, "win32", ("insufficient encryption", "remove the robot in Settings")),
        (0x11, "linux", ("insufficient resource", "wait a moment")),
        (0x77, "linux", ("ATT error 0x77, not in the specification", "wake the robot")),
    ],
)
def test_gatt_errors_are_told_by_name(code: int, platform: str, texts: tuple[str, str]) -> None:
    told = explain(BleakGATTProtocolError(code), "handshake", platform)
    assert isinstance(told, LastingFailureError)
    assert str(told).startswith("handshake: ")
    for text in texts:
        assert text in f"{told}\n{told.hint}"


@given(
    st.one_of(
        st.builds(BleakError, st.one_of(st.text(), st.integers(), st.none())),
        st.builds(BleakDBusError, st.text(), st.lists(st.one_of(st.text(), st.integers()), max_size=2)),
        st.builds(BleakGATTProtocolError, st.integers(0, 255)),
        st.builds(OSError, st.integers(), st.text()),
        st.builds(EOFError, st.text()),
        st.builds(DBusFastError, st.text()),
    ),
    st.sampled_from(STEPS),
    st.sampled_from(PLATFORMS),
)
def test_whatever_is_raised_becomes_short_words_and_a_hint(
    error: Exception,
    doing: str,
    platform: str,
) -> None:
    told = explain(error, doing, platform)
    assert isinstance(told, SpheroProbeError)
    assert told.exit_code in (3, 4, 9)
    assert 0 < len(str(told)) < 300
    assert told.hint
    if doing == "scan":
        assert told.exit_code != ConnectionFailedError.exit_code


def test_adapters_that_cannot_be_asked_for_make_nothing_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", "unix:path=/no/such/socket")

    async def fail() -> None:
        async with step("scan", 1):
            raise BleakError("adapter 'hci7' not found")

    with pytest.raises(NoSuchAdapterError, match="hci7") as caught:
        asyncio.run(fail())
    assert caught.value.hint == "list the adapters with: bluetoothctl list"


@pytest.mark.parametrize(
    ("uuids", "words"),
    [
        pytest.param((), "none", id="none"),
        pytest.param(
            (API_SERVICE.upper(), V1_CONTROL_SERVICE), "Sphero V2 API, Sphero V1 control", id="known"
        ),
        pytest.param(
            ("0000abcd-0000-1000-8000-00805f9b34fb",), "0000abcd-0000-1000-8000-00805f9b34fb", id="other"
        ),
        pytest.param([str(n) for n in range(30)], "0, 1, 2, 3, 4, 5, and 24 more", id="many"),
        pytest.param(("x" * 5000,), "x" * 36, id="endless"),
    ],
)
def test_services_are_told_briefly(uuids: Sequence[str], words: str) -> None:
    assert list_services(uuids) == words
