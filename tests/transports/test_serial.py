"""Robots at a wire: a real pseudo-terminal, serialx unpatched, and the fake robot at the other end."""

import asyncio
import errno
import json
import os
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import (
    AbstractAsyncContextManager,
    asynccontextmanager,
    closing,
)
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.simulator import Executed
from tests.support.cli import Cli, Ran
from tests.support.connections import hear

pytest.importorskip("termios", reason="pseudo-terminals are a POSIX thing")

import fcntl
import tty

import serialx

from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import (
    ConnectionFailedError,
    LinkLostError,
    RobotNotFoundError,
    SpheroProbeError,
    UnavailableError,
    UsageError,
)
from sphero_probe.link.exchange import Answered
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Request, Role
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.transports import serial
from sphero_probe.transports.base import Connection, OpenOptions
from sphero_probe.transports.registry import DeviceAddress, open_transport, parse_address
from sphero_probe.transports.serial import SerialTransport
from sphero_probe.transports.serial_address import Port, parse_port

CODEC = CODECS[Generation.V2]
PATIENCE = 30
"""Seconds for what takes a moment; only a hang needs them."""
LOTS = 1 << 20
"""More bytes than a pseudo-terminal holds."""


class Wire:
    """A pseudo-terminal: the tool opens ``path``, the robot's end is ``end``.

    Attributes:
        heard: every byte that arrived at the robot's end while somebody listened there.
    """

    def __init__(self) -> None:
        self.end, self._kept_open = os.openpty()
        tty.setraw(self._kept_open)
        os.set_blocking(self.end, False)
        self.path = os.ttyname(self._kept_open)
        self.heard = bytearray()
        self._more = asyncio.Event()
        self._robot: FakeRobot | None = None
        self._listening = False

    def listen(self) -> None:
        """Take in what arrives from now on, on the running event loop."""
        self._listening = True
        asyncio.get_running_loop().add_reader(self.end, self._hear)

    def plug_in(self, robot: FakeRobot) -> None:
        """Let this robot hear and answer, on the running event loop."""
        self._robot = robot
        self.listen()

    async def has_heard(self, size: int) -> None:
        """Wait until this many bytes have arrived."""
        while len(self.heard) < size:
            self._more.clear()
            await self._more.wait()

    def unplug(self) -> None:
        """Pull the robot's end out of the wire."""
        if self._listening:
            asyncio.get_running_loop().remove_reader(self.end)
        self._listening = False
        if self.end >= 0:
            os.close(self.end)
        self.end = -1

    def occupy(self) -> None:
        """Lock the port as another program does."""
        fcntl.flock(self._kept_open, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def close(self) -> None:
        os.close(self._kept_open)
        if self.end >= 0:
            os.close(self.end)

    def _hear(self) -> None:
        data = os.read(self.end, LOTS)
        self.heard += data
        self._more.set()
        if self._robot:
            self._robot.hear(data, now=asyncio.get_running_loop().time())
            self._speak()

    def _speak(self) -> None:
        loop = asyncio.get_running_loop()
        if self._robot is None or self.end < 0:
            return
        for chunk in self._robot.speak(now=loop.time()):
            os.write(self.end, chunk)
        if (due := self._robot.next_time()) is not None:
            loop.call_at(due, self._speak)


@pytest.fixture
def wire() -> Iterator[Wire]:
    with closing(Wire()) as wire:
        yield wire


def opening(address: str, **options: Any) -> AbstractAsyncContextManager[Connection]:
    return open_transport(parse_address(address), OpenOptions(**options))


@asynccontextmanager
async def at_a_port(wire: Wire, settings: str) -> AsyncIterator[Connection]:
    wire.plug_in(FakeRobot(parse_settings(settings)))
    async with opening(f"serial:{wire.path}?robot={settings.partition('?')[0]}") as connection:
        yield connection
    wire.unplug()


@asynccontextmanager
async def at_a_socket(_: Wire, settings: str) -> AsyncIterator[Connection]:
    robot = FakeRobot(parse_settings(settings))
    gone = asyncio.Event()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(LOTS):
            robot.hear(data, now=0.0)
            writer.writelines(robot.speak(now=0.0))
        writer.close()
        gone.set()

    async with await asyncio.start_server(serve, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        model = settings.partition("?")[0]
        async with opening(f"serial:socket://127.0.0.1:{port}?robot={model}") as connection:
            yield connection
        await gone.wait()


AtALine = Callable[[Wire, str], AbstractAsyncContextManager[Connection]]
LINES = [pytest.param(at_a_port, id="port"), pytest.param(at_a_socket, id="socket")]


@pytest.mark.parametrize("opened", LINES)
@pytest.mark.parametrize(
    "payload",
    [b"", b"\x8d\xd8\xab", b"\x03\x04\x0a\x0d\x11\x13\x1a\x7f", bytes(range(16))],
    ids=["empty", "escapes", "terminal-controls", "longest"],
)
def test_what_is_written_is_answered(wire: Wire, opened: AtALine, payload: bytes) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opened(wire, "bolt?split=3") as connection:
            assert connection.robot is ROBOTS["bolt"]
            assert connection.generation is Generation.V2
            assert connection.port == 0
            frame = CODEC.encode_command(Command(0x10, 0x00, payload, 0x01), 9)
            await connection.transport.write(frame)
            assert (await hear(connection, 9)).payload == payload

    asyncio.run(work())


@pytest.mark.parametrize("opened", LINES)
def test_once_closed_reads_end_and_writes_fail(wire: Wire, opened: AtALine) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE):
            async with opened(wire, "bolt") as connection:
                transport = connection.transport
            assert await transport.read() == b""
            assert await transport.read() == b""
            with pytest.raises(LinkLostError):
                await transport.write(b"\x8d")

    asyncio.run(work())


def test_the_port_can_be_opened_again_after_closing(wire: Wire) -> None:
    async def work() -> None:
        for _ in range(3):
            async with opening(f"serial:{wire.path}") as connection:
                assert connection.robot is ROBOTS["rvr"]

    asyncio.run(work())


def test_opening_tells_its_step_and_where_it_is(wire: Wire) -> None:
    steps: list[str] = []

    async def work() -> Connection:
        async with opening(f"serial:{wire.path}?baud=57600", on_step=steps.append) as connection:
            return connection

    connection = asyncio.run(work())
    assert steps == ["open"]
    assert connection.name == wire.path
    assert connection.address == f"serial:{wire.path}?baud=57600"
    assert connection.robot is ROBOTS["rvr"]


@pytest.mark.parametrize(
    ("query", "speed"), [("", "B115200"), ("?baud=57600", "B57600")], ids=["default", "chosen"]
)
def test_the_port_is_set_to_8n1_at_its_rate(wire: Wire, query: str, speed: str) -> None:
    import termios

    async def work() -> list[Any]:
        async with opening(f"serial:{wire.path}{query}"):
            return termios.tcgetattr(wire.end)

    iflag, oflag, cflag, lflag, ispeed, ospeed, _ = asyncio.run(work())
    assert (ispeed, ospeed) == (getattr(termios, speed),) * 2
    assert cflag & termios.CSIZE == termios.CS8
    assert not cflag & (termios.PARENB | termios.CSTOPB)
    assert not iflag & (termios.IXON | termios.IXOFF | termios.ICRNL | termios.ISTRIP)
    assert not oflag & termios.OPOST
    assert not lflag & (termios.ICANON | termios.ECHO | termios.ISIG)


def test_an_rvr_answers_at_addresses_of_a_wire(wire: Wire) -> None:
    async def work() -> Answered:
        wire.plug_in(FakeRobot(parse_settings("rvr?line=uart")))
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            assert connection.robot
            policy = Policy(connection.generation, connection.robot, Consent())
            async with Link(connection.transport, CODEC, policy) as link:
                exchange = await link.ask(Command(0x13, 0x10, b"", connection.port << 4 | 1))
        wire.unplug()
        assert isinstance(exchange, Answered)
        return exchange

    exchange = asyncio.run(work())
    (request,) = CODEC.decoder(Role.ROBOT).feed(bytes(wire.heard))
    assert isinstance(request, Request)
    assert (request.command.target, request.source) == (0x01, 0x01)
    assert (exchange.response.target, exchange.response.source) == (0x21, 0x01)
    assert exchange.response.code == 0


def test_both_nodes_of_an_rvr_are_told_apart(wire: Wire) -> None:
    async def work() -> list[int | None]:
        wire.plug_in(FakeRobot(parse_settings("rvr?line=uart")))
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            policy = Policy(connection.generation, connection.robot, Consent())
            async with Link(connection.transport, CODEC, policy) as link:
                asked = (link.ask(Command(0x11, 0x00, b"", target)) for target in (0x01, 0x02))
                exchanges = await asyncio.gather(*asked)
        wire.unplug()
        return [exchange.response.source for exchange in exchanges if isinstance(exchange, Answered)]

    assert asyncio.run(work()) == [0x01, 0x02]


def test_rfcomm_is_a_classic_sphero_at_a_port(wire: Wire) -> None:
    ping = bytes.fromhex("ff ff 00 01 52 01 ab")
    pong = bytes.fromhex("ff ff 00 52 01 ac")

    async def work() -> Connection:
        async with asyncio.timeout(PATIENCE), opening(f"rfcomm:{wire.path}") as connection:
            await connection.transport.write(ping)
            assert os.read(wire.end, LOTS) == ping
            os.write(wire.end, pong)
            heard = b""
            while heard != pong:
                heard += await connection.transport.read()
            return connection

    connection = asyncio.run(work())
    assert connection.robot is ROBOTS["sphero"]
    assert connection.generation is Generation.V1
    assert connection.address == f"rfcomm:{wire.path}"


def test_a_model_that_the_catalogue_does_not_have_is_said_so(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(ROBOTS, "sphero", raising=False)

    async def work() -> None:
        async with opening(f"rfcomm:{wire.path}"):
            pass

    with pytest.raises(UsageError, match="no robot 'sphero'"):
        asyncio.run(work())


def test_writing_waits_until_everything_has_left(wire: Wire) -> None:
    data = bytes(range(256)) * (LOTS // 1024)

    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            wire.listen()
            await connection.transport.write(data)
            in_the_wire = len(data) - len(wire.heard)
            assert in_the_wire < len(data) // 2
            await wire.has_heard(len(data))
            wire.unplug()

    asyncio.run(work())
    assert bytes(wire.heard) == data


def test_a_port_that_takes_nothing_loses_the_link(wire: Wire, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial, "_WRITE_TIMEOUT", 0.02)

    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            with pytest.raises(LinkLostError, match="takes no more"):
                await connection.transport.write(bytes(LOTS))
            with pytest.raises(LinkLostError, match="closed"):
                await connection.transport.write(b"\x8d")
            assert await connection.transport.read() == b""

    asyncio.run(work())


def test_unplugging_ends_reading(wire: Wire) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            os.write(wire.end, b"\x8d\xd8")
            heard = await connection.transport.read()
            while heard != b"\x8d\xd8":
                heard += await connection.transport.read()
            wire.unplug()
            assert await connection.transport.read() == b""
            with pytest.raises(LinkLostError) as caught:
                await connection.transport.write(b"\x8d")
            assert "plugged in" in caught.value.hint

    asyncio.run(work())


def test_a_write_right_after_unplugging_fails_before_anybody_read(wire: Wire) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            wire.unplug()
            with pytest.raises(LinkLostError):
                await connection.transport.write(b"\x8d")
            assert await connection.transport.read() == b""

    asyncio.run(work())


def test_unplugging_frees_a_write_that_waits(wire: Wire) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            asyncio.get_running_loop().call_soon(wire.unplug)
            with pytest.raises(LinkLostError):
                await connection.transport.write(bytes(LOTS))

    asyncio.run(work())


def test_unplugging_ends_an_exchange_that_waits(wire: Wire) -> None:
    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opening(f"serial:{wire.path}") as connection:
            policy = Policy(connection.generation, connection.robot, Consent())
            async with Link(connection.transport, CODEC, policy, timeout=PATIENCE) as link:
                asyncio.get_running_loop().call_soon(wire.unplug)
                with pytest.raises(LinkLostError):
                    await link.ask(Command(0x13, 0x10, b"", 0x01))

    asyncio.run(work())


def test_a_server_that_hangs_up_ends_reading() -> None:
    async def hang_up(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.close()

    async def work() -> None:
        async with asyncio.timeout(PATIENCE), await asyncio.start_server(hang_up, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            async with opening(f"serial:socket://127.0.0.1:{port}") as connection:
                assert await connection.transport.read() == b""
                with pytest.raises(LinkLostError):
                    await connection.transport.write(b"\x8d")

    asyncio.run(work())


class Stubborn(asyncio.Transport):
    """A port whose closing goes wrong, or never ends."""

    def __init__(self, error: Exception | None) -> None:
        super().__init__()
        self.error = error
        self.aborted = False

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        pass

    def is_closing(self) -> bool:
        return self.aborted

    def write(self, data: bytes | bytearray | memoryview) -> None:
        raise OSError(errno.EIO, "Input/output error")

    def abort(self) -> None:
        self.aborted = True

    async def wait_closed(self) -> None:
        if self.error:
            raise self.error
        await asyncio.Event().wait()


@pytest.mark.parametrize("error", [OSError(errno.EIO, "Input/output error"), None], ids=["fails", "hangs"])
def test_a_port_that_cannot_be_closed_is_left(monkeypatch: pytest.MonkeyPatch, error: OSError | None) -> None:
    monkeypatch.setattr(serial, "_CLOSE_TIMEOUT", 0.01)

    async def work() -> None:
        transport = SerialTransport()
        line = Stubborn(error)
        transport.connection_made(line)
        with pytest.raises(LinkLostError, match="Input/output error"):
            await transport.write(b"\x8d")
        async with asyncio.timeout(PATIENCE):
            await transport.close()
            assert await transport.read() == b""
            await transport.close()
        assert line.aborted

    asyncio.run(work())


KEPT_FROM_OPENING = [
    pytest.param(FileNotFoundError(errno.ENOENT, "x"), RobotNotFoundError, "no serial port", id="missing"),
    pytest.param(OSError(errno.EIO, "x"), RobotNotFoundError, "no serial port", id="no-chip-behind-it"),
    pytest.param(OSError(errno.ENXIO, "x"), RobotNotFoundError, "no serial port", id="no-device"),
    pytest.param(PermissionError(errno.EACCES, "x"), UnavailableError, "not allowed", id="permission"),
    pytest.param(OSError(errno.EBUSY, "x"), ConnectionFailedError, "in use", id="busy"),
    pytest.param(OSError(errno.ENOTTY, "x"), UsageError, "no serial port", id="not-a-terminal"),
    pytest.param(OSError(errno.EHOSTUNREACH, "no route"), ConnectionFailedError, "no route", id="no-route"),
    pytest.param(socket.gaierror(-2, "unknown name"), ConnectionFailedError, "unknown name", id="no-host"),
    pytest.param(TimeoutError(), ConnectionFailedError, "in time", id="time-out"),
    pytest.param(ValueError("no port in it"), UsageError, "no port in it", id="bad-url"),
    pytest.param(serialx.UnsupportedSetting("too fast"), UsageError, "too fast", id="unsupported-rate"),
    pytest.param(serialx.SerialException("refused"), ConnectionFailedError, "refused", id="server-refuses"),
    pytest.param(RuntimeError("wrong loop"), ConnectionFailedError, "wrong loop", id="wrong-loop"),
]


@pytest.mark.parametrize(("raised", "shown", "said"), KEPT_FROM_OPENING)
def test_whatever_keeps_a_port_from_opening_is_explained(
    monkeypatch: pytest.MonkeyPatch,
    raised: Exception,
    shown: type[SpheroProbeError],
    said: str,
) -> None:
    async def fail(*_: object) -> None:
        raise raised

    monkeypatch.setattr(serialx, "create_serial_connection", fail)

    async def work() -> None:
        async with opening("serial:/dev/ttyX0"):
            pass

    with pytest.raises(SpheroProbeError, match=said) as caught:
        asyncio.run(work())
    assert type(caught.value) is shown
    assert "/dev/ttyX0" in str(caught.value)
    assert caught.value.hint


def test_the_error_of_termios_counts_like_that_of_the_system(monkeypatch: pytest.MonkeyPatch) -> None:
    import termios

    async def fail(*_: object) -> None:
        raise termios.error(errno.ENOTTY, "Inappropriate ioctl for device")

    monkeypatch.setattr(serialx, "create_serial_connection", fail)

    async def work() -> None:
        async with opening("serial:/dev/ttyX0"):
            pass

    with pytest.raises(UsageError, match="is no serial port"):
        asyncio.run(work())


def test_opening_that_never_ends_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    async def hang(*_: object) -> None:
        await asyncio.Event().wait()

    monkeypatch.setattr(serialx, "create_serial_connection", hang)

    async def work() -> None:
        async with asyncio.timeout(PATIENCE), opening("serial:/dev/ttyX0", timeout=0.01):
            pass

    with pytest.raises(ConnectionFailedError, match="open: /dev/ttyX0 does not answer in time"):
        asyncio.run(work())


def shown(ran: Ran, code: int, said: str, hint: str = "") -> None:
    """One line that says it, one that helps, and the exit code."""
    assert ran.code == code, ran.err
    first, *more = ran.err.splitlines()
    assert first.startswith("sphero-probe: ")
    assert said in first
    assert len(more) == 1
    assert hint in more[0]


def test_without_serialx_the_command_that_installs_it_is_named(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "serialx", None)
    ran = cli("info", "--device", "serial:/dev/ttyS0")
    shown(ran, 9, "serialx, which is not installed", "pip install 'sphero-probe[serial]'")


def told(device: str, **of_itself: str) -> serialx.SerialPortInfo:
    """A port as serialx lists it, by another path than the one that people type."""
    silent: dict[str, Any] = dict.fromkeys(
        ("vid", "pid", "serial_number", "manufacturer", "product", "bcd_device", "interface_num")
    )
    silent["interface_description"] = None
    return serialx.SerialPortInfo(device=f"/by-id{device}", resolved_device=device, **(silent | of_itself))


def test_ports_are_listed_with_what_they_tell_of_themselves(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("rfcomm10", "rfcomm2", "rfkill"):
        (tmp_path / name).touch()
    found = [
        told("/dev/ttyUSB10", manufacturer="FTDI", product="FT232R", interface_description="FT232R"),
        told("/dev/ttyUSB9", product="CP2102"),
        told("/dev/ttyS0"),
    ]
    monkeypatch.setattr(serial, "DEV", tmp_path)
    monkeypatch.setattr(serialx, "list_serial_ports", lambda: found)
    assert [tuple(port) for port in serial.ports() if "rfcomm" not in port.path] == [
        ("/dev/ttyS0", ""),
        ("/dev/ttyUSB9", "CP2102"),
        ("/dev/ttyUSB10", "FTDI FT232R"),
    ]
    assert [tuple(port) for port in serial.ports() if "rfcomm" in port.path] == [
        (str(tmp_path / "rfcomm2"), "Bluetooth Classic"),
        (str(tmp_path / "rfcomm10"), "Bluetooth Classic"),
    ]


def test_a_machine_without_ports_lists_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(serial, "DEV", tmp_path / "missing")
    monkeypatch.setattr(serialx, "list_serial_ports", list)
    assert serial.ports() == []


@pytest.mark.parametrize("raised", [PermissionError(errno.EACCES, "sysfs"), ValueError("no number")])
def test_ports_that_cannot_be_listed(
    monkeypatch: pytest.MonkeyPatch, raised: PermissionError | ValueError
) -> None:
    def fail() -> list[serialx.SerialPortInfo]:
        raise raised

    monkeypatch.setattr(serialx, "list_serial_ports", fail)
    with pytest.raises(UnavailableError, match="cannot be listed") as caught:
        serial.ports()
    assert caught.value.hint


def test_listing_ports_needs_serialx(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serialx", None)
    with pytest.raises(UnavailableError, match="serialx, which is not installed"):
        serial.ports()


@pytest.mark.parametrize(
    ("address", "code", "said"),
    [
        pytest.param("serial:/no/such/port", 3, "there is no serial port /no/such/port", id="missing"),
        pytest.param("rfcomm:/no/such/port?robot=rvr", 3, "no serial port /no/such", id="rfcomm-missing"),
        pytest.param("serial:COM3", 3, "no serial port COM3", id="windows-name-here"),
        pytest.param("serial:/", 2, "/ is no serial port", id="directory"),
        pytest.param(f"serial:{__file__}", 2, "is no serial port", id="file"),
        pytest.param("serial:/dev/null", 2, "/dev/null is no serial port", id="device-of-another-kind"),
        pytest.param("serial:socket://127.0.0.1", 2, "host and port", id="socket-without-port"),
        pytest.param("serial:/dev/null?robt=rvr", 2, "parameter 'robt'", id="unknown-parameter"),
        pytest.param("serial:/dev/null?robot=rvt", 2, "no robot 'rvt'", id="unknown-robot"),
        pytest.param("serial:/dev/null?baud=fast", 2, "baud=fast", id="not-a-rate"),
        pytest.param("serial:?robot=rvr", 2, "no serial port is named", id="no-port"),
    ],
)
def test_what_cannot_be_opened(cli: Cli, address: str, code: int, said: str) -> None:
    shown(cli("info", "--device", address), code, said)


def test_a_port_that_another_program_holds(cli: Cli, wire: Wire) -> None:
    wire.occupy()
    shown(cli("info", "--device", f"serial:{wire.path}"), 4, f"{wire.path} is in use", "close that one")


def test_a_server_that_is_not_there(cli: Cli) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"serial:socket://127.0.0.1:{taken.getsockname()[1]}"
        shown(cli("info", "--device", address), 4, "nothing listens at socket://127.0.0.1")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open everything")
def test_a_port_that_is_not_ours(cli: Cli, tmp_path: Path) -> None:
    port = tmp_path / "port"
    port.touch(mode=0)
    shown(cli("info", "--device", f"serial:{port}"), 9, "not allowed to use", "dialout")


async def tool(*arguments: str) -> tuple[int | None, str, str]:
    """Run the tool as a process while this event loop plays the robot."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "sphero_probe",
        *arguments,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    out, err = await process.communicate()
    return process.returncode, out.decode(), err.decode()


def test_the_whole_tool_at_a_port(wire: Wire) -> None:
    async def work() -> tuple[int | None, str, str]:
        wire.plug_in(FakeRobot(parse_settings("rvr?split=5")))
        async with asyncio.timeout(2 * PATIENCE):
            ran = await tool("info", "--json", "-v", "--device", f"serial:{wire.path}")
        wire.unplug()
        return ran

    code, out, err = asyncio.run(work())
    assert code == 0, err
    facts = {(fact["name"], fact["node"]): fact["value"] for fact in json.loads(out)}
    assert facts["model", None] == "Sphero RVR"
    assert facts["address", None] == f"serial:{wire.path}"
    assert ("main_app_version", "primary") in facts
    assert ("main_app_version", "secondary") in facts
    assert err.splitlines()[0].split()[-1] == "open"
    packets = CODEC.decoder(Role.ROBOT).feed(bytes(wire.heard))
    targets = {packet.command.target for packet in packets if isinstance(packet, Request)}
    assert {0x01, 0x02} <= targets <= {0x01, 0x02, None}


def test_the_whole_tool_sweeps_at_a_port_and_executes_reads_only(wire: Wire) -> None:
    executed: list[Executed] = []

    async def work() -> tuple[int | None, str, str]:
        wire.plug_in(FakeRobot(parse_settings("rvr"), on_execute=executed.append))
        device = f"serial:{wire.path}"
        async with asyncio.timeout(2 * PATIENCE):
            ran = await tool(
                "sweep", "--did", "power", "--cid", "0-0x1f", "--format", "jsonl", "--device", device
            )
        wire.unplug()
        return ran

    code, out, err = asyncio.run(work())
    assert code == 0, err
    rows = [json.loads(line) for line in out.splitlines()]
    findings = {row["cid"]: row for row in rows if row["type"] == "finding"}
    assert sorted(findings) == list(range(0x20))
    assert findings[0x10]["outcome"] == "exists"
    assert findings[0x10]["target"] == 0x01
    assert {command.risk.word for command in executed} == {"read"}


def test_unplugging_in_the_middle_ends_the_tool_with_4(wire: Wire) -> None:
    async def unplug_in_the_middle() -> None:
        await wire.has_heard(600)
        wire.unplug()

    async def work() -> tuple[int | None, str, str]:
        wire.plug_in(FakeRobot(parse_settings("rvr?line=uart")))
        unplugging = asyncio.create_task(unplug_in_the_middle())
        async with asyncio.timeout(2 * PATIENCE):
            device = f"serial:{wire.path}"
            ran = await tool("sweep", "--did", "0x13,0x1a", "--format", "jsonl", "--device", device)
            await unplugging
        return ran

    code, out, err = asyncio.run(work())
    assert code == 4, err
    rows = [json.loads(line) for line in out.splitlines()]
    assert rows[-1]["type"] == "summary"
    assert rows[-1]["complete"] is False
    assert "Traceback" not in err
    assert any(word in err for word in ("lost", "closed", "gone", "did not come back"))


@pytest.mark.parametrize(
    ("text", "port"),
    [
        pytest.param("/dev/ttyS0", Port("/dev/ttyS0", ROBOTS["rvr"], 115200), id="path"),
        pytest.param("COM3", Port("COM3", ROBOTS["rvr"], 115200), id="windows"),
        pytest.param("/dev/x?robot=BOLT%2B", Port("/dev/x", ROBOTS["bolt-plus"], 115200), id="encoded-alias"),
        pytest.param("/dev/x?robot=rvr+", Port("/dev/x", ROBOTS["rvr-plus"], 115200), id="plain-plus"),
        pytest.param("/dev/x?baud=9600&robot=bolt", Port("/dev/x", ROBOTS["bolt"], 9600), id="both"),
        pytest.param("/dev/x?", Port("/dev/x", ROBOTS["rvr"], 115200), id="nothing-asked"),
        pytest.param("socket://h:1?baud=50", Port("socket://h:1", ROBOTS["rvr"], 50), id="url"),
        pytest.param("x://h?key=1?", Port("x://h?key=1", ROBOTS["rvr"], 115200), id="query-of-its-own"),
        pytest.param("x://h?a=1&b=2?baud=300", Port("x://h?a=1&b=2", ROBOTS["rvr"], 300), id="both-queries"),
    ],
)
def test_ports(text: str, port: Port) -> None:
    assert parse_port(text, "rvr") == port


@pytest.mark.parametrize(
    ("text", "said", "hint"),
    [
        ("/dev/x?boud=9600", "unknown serial port parameter 'boud'", "did you mean 'baud'?"),
        ("/dev/x?colour=red", "unknown serial port parameter 'colour'", "known: robot, baud"),
        ("x://h?key=1", "unknown serial port parameter 'key'", "one more '?'"),
        ("/dev/x?robot=bolt&robot=rvr", "'robot' is given twice", ""),
        ("/dev/x?robot=bold", "no robot 'bold'", "did you mean 'bolt'?"),
        ("/dev/x?robot=", "no robot ''", "known: "),
        ("/dev/x?baud=0", "baud=0 is no rate", "from 50"),
        ("/dev/x?baud=-9600", "baud=-9600 is no rate", "115200"),
        ("/dev/x?baud=10000001", "is no rate", "to 10000000"),
        ("/dev/x?baud=9600.0", "is no rate", ""),
        ("/dev/x?baud=²", "is no rate", ""),
        ("?baud=9600", "no serial port is named", "/dev/ttyUSB0"),
        ("", "no serial port is named", "COM3"),
    ],
)
def test_ports_that_make_no_sense(text: str, said: str, hint: str) -> None:
    with pytest.raises(UsageError, match=said.replace("?", r"\?")) as caught:
        parse_port(text, "rvr")
    assert hint in caught.value.hint


@given(
    url=st.text(min_size=1).filter(lambda text: "?" not in text),
    robot=st.sampled_from(list(ROBOTS)),
    baud=st.integers(50, 10_000_000),
)
def test_any_port_is_read_as_it_was_written(url: str, robot: str, baud: int) -> None:
    assert parse_port(f"{url}?robot={robot}&baud={baud}", "rvr") == Port(url, ROBOTS[robot], baud)


@given(st.text())
def test_any_text_is_a_port_or_a_usage_error(text: str) -> None:
    try:
        port = parse_port(text, "rvr")
    except UsageError:
        return
    assert port.url


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("serial:/dev/ttyS0", DeviceAddress("serial", "/dev/ttyS0")),
        ("serial:COM3", DeviceAddress("serial", "COM3")),
        ("serial:socket://host:7?robot=bolt", DeviceAddress("serial", "socket://host:7?robot=bolt")),
        ("rfcomm:/dev/rfcomm0", DeviceAddress("rfcomm", "/dev/rfcomm0")),
    ],
)
def test_addresses(text: str, address: DeviceAddress) -> None:
    assert parse_address(text) == address
    assert str(address) == text


def test_serialx_waits_until_a_port_is_opened() -> None:
    code = "import sys; import sphero_probe.transports.serial; sys.exit('serialx' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
