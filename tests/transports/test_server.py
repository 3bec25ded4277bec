"""A served robot, reached as any program would: a socket, or a pseudo-terminal opened as a serial port."""

import asyncio
import json
import os
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Any, Final

import pytest

from sphero_probe.errors import UnavailableError, UsageError
from sphero_probe.link.exchange import Answered
from sphero_probe.link.link import Link
from sphero_probe.link.policy import Consent, Policy
from sphero_probe.protocol.packets import Command
from sphero_probe.protocol.v2 import V2
from sphero_probe.transports.fake_address import on_a_wire
from sphero_probe.transports.registry import open_transport, parse_address
from sphero_probe.transports.server import Server, serve_pty, serve_tcp

PATIENCE: Final = 20
"""Seconds after which a test that hangs has failed."""
ECHO: Final = bytes.fromhex("8d1a0110000201020301cbd8")
ECHOED: Final = bytes.fromhex("8d29011000020001020301bcd8")
"""As the maker's SDK writes and hears it."""

Serving = Callable[[str], AbstractAsyncContextManager[Server]]


def _tcp(address: str) -> AbstractAsyncContextManager[Server]:
    return serve_tcp(parse_address(address), "127.0.0.1", 0)


def _pty(address: str) -> AbstractAsyncContextManager[Server]:
    return serve_pty(parse_address(address))


EACH: Final = pytest.mark.parametrize(
    "serving",
    [
        pytest.param(_tcp, id="TCP"),
        pytest.param(
            _pty,
            id="pseudo-terminal",
            marks=pytest.mark.skipif(sys.platform != "linux", reason="hang-ups are those of Linux"),
        ),
    ],
)


def _run(work: Callable[[], Any]) -> Any:
    async def limited() -> Any:
        async with asyncio.timeout(PATIENCE):
            return await work()

    return asyncio.run(limited())


@asynccontextmanager
async def _linked(server: Server) -> AsyncIterator[Link]:
    async with open_transport(parse_address(server.device)) as connection:
        assert connection.robot
        policy = Policy(connection.generation, connection.robot, Consent())
        async with Link(connection.transport, V2, policy) as link:
            yield link


@EACH
def test_a_serial_client_reads_both_nodes(serving: Serving) -> None:
    async def work() -> list[tuple[int, int | None, int | None]]:
        async with serving("fake:rvr?line=uart") as server, _linked(server) as link:
            asked = [await link.ask(Command(0x10, 0x00, b"", node)) for node in (0x01, 0x02, 0x05)]
        answers = [one.response for one in asked if isinstance(one, Answered)]
        return [(one.code, one.source, one.target) for one in answers]

    assert _run(work) == [(0x00, 1, 0x21), (0x00, 2, 0x21), (0x09, 1, 0x21)]


@EACH
def test_a_recorded_robot_starts_again_for_each_client(serving: Serving, tmp_path: Path) -> None:
    """Over Bluetooth it was asked as 0x11, here as 0x01."""
    path = tmp_path / "run.jsonl"
    finding = {"type": "finding", "sent": "8d3a11011310246cd8", "received": "8d39110113102400313cd8"}
    later = finding | {"received": "8d39110113102400323bd8"}
    path.write_text(
        "".join(f"{json.dumps(one)}\n" for one in [{"type": "run", "robot": "rvr"}, finding, later])
    )

    async def work() -> list[tuple[int, bytes]]:
        heard: list[tuple[int, bytes]] = []
        async with serving(f"replay:{path}?speed=0") as server:
            for _ in range(2):
                async with _linked(server) as link:
                    for cid in (0x10, 0x10, 0x17):
                        answer = await link.ask(Command(0x13, cid, b"", 0x01))
                        assert isinstance(answer, Answered)
                        heard.append((answer.response.code, answer.response.payload))
                await server.served.wait()
                server.served.clear()
        return heard

    assert _run(work) == [(0, b"\x31"), (0, b"\x32"), (0xEE, b"not recorded")] * 2


@EACH
def test_clients_come_one_after_another_to_the_same_robot(serving: Serving, tmp_path: Path) -> None:
    ledger, truth = tmp_path / "ledger.jsonl", tmp_path / "truth.jsonl"

    async def work() -> None:
        async with serving(f"fake:rvr?line=uart&ledger={ledger}&truth={truth}") as server:
            assert truth.read_bytes().count(b"\n") > 100
            for number in range(3):
                async with _linked(server) as link:
                    assert isinstance(await link.ask(Command(0x10, 0x00, bytes([number]), 0x01)), Answered)
                await server.served.wait()
                server.served.clear()

    _run(work)
    executed = [line for line in ledger.read_text().splitlines() if '"did":16' in line]
    assert [f'"payload":"0{number}"' in line for number, line in enumerate(executed)] == [True] * 3


def test_a_second_client_is_sent_away() -> None:
    async def work() -> tuple[bytes, bytes]:
        steps: list[str] = []
        served = serve_tcp(parse_address("fake:rvr?line=uart"), "127.0.0.1", 0, steps.append)
        async with served as server:
            host, _, port = server.where.rpartition(":")
            reader, writer = await asyncio.open_connection(host, int(port))
            writer.write(ECHO)
            first = await reader.readexactly(len(ECHOED))
            other, other_writer = await asyncio.open_connection(host, int(port))
            second = await other.read()
            writer.write(ECHO)
            assert await reader.readexactly(len(ECHOED)) == first
            for one in (writer, other_writer):
                one.close()
            await server.served.wait()
        assert steps[0] == "a client has connected"
        assert "in use" in steps[1]
        return first, second

    assert _run(work) == (ECHOED, b"")


def test_when_the_robot_drops_the_line_the_client_is_disconnected() -> None:
    async def work() -> bytes:
        async with _tcp("fake:rvr?line=uart&disconnect_after=2") as server:
            host, _, port = server.where.rpartition(":")
            reader, writer = await asyncio.open_connection(host, int(port))
            writer.write(ECHO + ECHO + ECHO)
            heard = await reader.read()
            writer.close()
            async with _linked(server) as link:
                assert isinstance(await link.ask(Command(0x10, 0x00, b"", 0x01)), Answered)
        return heard

    assert _run(work) == ECHOED * 2


@pytest.mark.skipif(sys.platform != "linux", reason="hang-ups are those of Linux")
def test_a_pseudo_terminal_gives_a_client_nothing_that_was_for_another() -> None:
    async def work() -> list[bytes]:
        async with _pty("fake:rvr?line=uart") as server:
            heard = []
            for unread in (ECHO * 3, b""):
                async with _terminal(server.where) as (reader, client):
                    os.write(client, ECHO + unread)
                    heard.append(await reader.readexactly(len(ECHOED)))
                await server.served.wait()
                server.served.clear()
            return heard

    assert _run(work) == [ECHOED] * 2


@asynccontextmanager
async def _terminal(path: str) -> AsyncIterator[tuple[asyncio.StreamReader, int]]:
    """A pseudo-terminal as a program opens it that knows nothing of serial ports."""
    client = os.open(path, os.O_RDWR | os.O_NOCTTY)
    reader = asyncio.StreamReader()
    pipe, _ = await asyncio.get_running_loop().connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(reader), os.fdopen(client, "rb", buffering=0)
    )
    try:
        yield reader, client
    finally:
        pipe.close()
        await asyncio.sleep(0)


def test_a_port_in_use_is_not_to_be_had() -> None:
    async def work() -> None:
        async with _tcp("fake:rvr") as server:
            port = int(server.where.rpartition(":")[2])
            async with serve_tcp(parse_address("fake:rvr"), "127.0.0.1", port):
                pass

    with pytest.raises(UnavailableError, match="cannot listen at 127"):
        _run(work)


@pytest.mark.parametrize(
    ("address", "device"),
    [("fake:rvr", "serial:socket://{}"), ("fake:bolt", "serial:socket://{}?robot=bolt")],
)
def test_the_address_that_reaches_it_back(address: str, device: str) -> None:
    async def work() -> tuple[str, str]:
        async with _tcp(address) as server:
            return server.device, server.where

    told, where = _run(work)
    assert told == device.format(where)


@pytest.mark.parametrize(
    ("rest", "wired"),
    [
        pytest.param("rvr", "rvr?line=uart", id="an RVR has a UART"),
        pytest.param("rvr?seed=3", "rvr?line=uart&seed=3", id="beside other settings"),
        pytest.param("rvr?", "rvr?line=uart", id="an empty query"),
        pytest.param("rvr?seed=3&line=ble", "rvr?seed=3&line=ble", id="unless told otherwise"),
        pytest.param("bolt?seed=3", "bolt?seed=3", id="a BOLT has none"),
    ],
)
def test_a_robot_at_the_end_of_a_wire(rest: str, wired: str) -> None:
    assert on_a_wire(rest) == wired


def test_a_robot_that_is_none() -> None:
    with pytest.raises(UsageError, match="unknown fake robot"):
        on_a_wire("toaster")
