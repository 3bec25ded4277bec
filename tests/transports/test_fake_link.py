"""The pipe to the built-in robot: what reads, writes and files do when the line drops and comes back."""

import asyncio
import json
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path

import pytest

from sphero_probe.errors import LinkLostError, OutputError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command, Generation, Notification, Response, Role
from sphero_probe.simulator import FakeRobot, parse_settings
from sphero_probe.simulator.robot import BOOTING
from sphero_probe.transports.base import Connection, OpenOptions, Transport
from sphero_probe.transports.fake import FakeTransport, open_connection
from tests.support.narrowing import every, known, only
from tests.support.virtual_clock import run

CODEC = CODECS[Generation.V2]
Again = Callable[[], AbstractAsyncContextManager[Connection]]
ECHO, NAME = Command(0x10, 0x00), Command(0x19, 0x03, b"Rey\0")


async def _all(transport: Transport) -> list[Response]:
    """Everything until the robot is gone, as packets."""
    said = []
    while chunk := await transport.read():
        said.append(chunk)
    return every(Response, CODEC.decoder(Role.HOST).feed(b"".join(said)))


async def _ask(transport: Transport, command: Command, seq: int = 0) -> Response:
    await transport.write(CODEC.encode_command(command, seq))
    decoder = CODEC.decoder(Role.HOST)
    while True:
        chunk = await transport.read()
        assert chunk
        for packet in decoder.feed(chunk):
            if isinstance(packet, Response):
                return packet


def test_what_was_said_is_read_and_then_nothing() -> None:
    async def work() -> tuple[list[int], bytes]:
        transport = FakeTransport(FakeRobot(parse_settings("bolt?disconnect_after=3")))
        for seq in range(3):
            await transport.write(CODEC.encode_command(ECHO, seq))
        with pytest.raises(LinkLostError):
            await transport.write(CODEC.encode_command(ECHO, 3))
        return [packet.seq for packet in await _all(transport)], await transport.read()

    assert run(work()) == ([0, 1, 2], b"")


def test_a_waiting_read_ends_with_the_line() -> None:
    async def work() -> tuple[list[Response], float]:
        transport = FakeTransport(
            FakeRobot(parse_settings("bolt?disconnect_after=1&latency=1s&interval=30ms"))
        )
        async with asyncio.TaskGroup() as group:
            reading = group.create_task(_all(transport))
            await asyncio.sleep(5)
            await transport.write(CODEC.encode_command(ECHO, 0))
        return reading.result(), asyncio.get_running_loop().time()

    packets, now = run(work())
    assert packets == []
    assert 5 < now < 5.1


def test_a_write_notices_that_the_line_has_dropped_meanwhile() -> None:
    async def work() -> None:
        robot = FakeRobot(parse_settings("bolt?disconnect_after=1&interval=30ms"))
        transport = FakeTransport(robot)
        await transport.write(CODEC.encode_command(ECHO, 0))
        await asyncio.sleep(1)
        with pytest.raises(LinkLostError):
            await transport.write(CODEC.encode_command(ECHO, 1))

    run(work())


def test_an_old_pipe_stays_dead_when_the_robot_is_reached_again() -> None:
    async def work() -> None:
        robot = FakeRobot(parse_settings("bolt"))
        old = FakeTransport(robot)
        robot.connect(now=asyncio.get_running_loop().time())
        new = FakeTransport(robot)
        assert (await _ask(new, ECHO)).code == 0
        assert await old.read() == b""
        with pytest.raises(LinkLostError):
            await old.write(b"\x8d")

    run(work())


def _pairs(path: Path) -> list[tuple[int, int]]:
    return [(line["did"], line["cid"]) for line in map(json.loads, path.read_text().splitlines())]


@pytest.mark.parametrize(
    "nested", [True, False], ids=["while the first is open", "after the first is closed"]
)
def test_again_is_the_very_same_robot_and_the_ledger_goes_on(tmp_path: Path, nested: bool) -> None:
    ledger, truth = tmp_path / "ledger", tmp_path / "truth"
    ledger.write_text("from another day\n")

    async def reach(again: Again | None) -> Again | None:
        async with known(again)() as connection:
            assert connection.name == "Rey"
            assert (await _ask(connection.transport, ECHO)).code == 0
            assert len(_pairs(ledger)) == 2
            return connection.again

    async def work() -> None:
        address = f"bolt?disconnect_after=1&ledger={ledger}&truth={truth}"
        async with open_connection(address, OpenOptions()) as first:
            assert (await _ask(first.transport, NAME)).code == 0
            assert await first.transport.read() == b""
            written = truth.read_text()
            again = first.again
            if nested:
                again = await reach(first.again)
        if not nested:
            again = await reach(first.again)
        async with known(again)() as last:
            assert (await _ask(last.transport, ECHO)).code == 0
            assert last.address == first.address
        assert truth.read_text() == written

    run(work())
    assert _pairs(ledger) == [(NAME.did, NAME.cid), (0x10, 0x00), (0x10, 0x00)]
    facts = FakeRobot(parse_settings("bolt")).truth()
    assert list(map(json.loads, truth.read_text().splitlines())) == [fact.as_json() for fact in facts]


def test_two_openings_of_one_address_are_two_robots() -> None:
    async def work() -> None:
        async with open_connection("bolt", OpenOptions()) as one:
            await _ask(one.transport, NAME)
            async with known(one.again)() as same:
                assert same.name == "Rey"
        async with open_connection("bolt", OpenOptions()) as other:
            assert other.name != "Rey"

    run(work())


def test_a_reboot_over_the_pipe() -> None:
    async def work() -> None:
        async with open_connection("bolt?reboot_on=0x13:0x10", OpenOptions()) as first:
            loop = asyncio.get_running_loop()
            await first.transport.write(CODEC.encode_command(Command(0x13, 0x10), 0))
            assert await first.transport.read() == b""
            async with known(first.again)() as second:
                await second.transport.write(CODEC.encode_command(ECHO, 1))
                greeting = only(Notification, CODEC.decoder(Role.HOST).feed(await second.transport.read()))
                assert (greeting.did, greeting.cid) == (0x13, 0x11)
                assert loop.time() == BOOTING
                assert (await _ask(second.transport, ECHO, 2)).seq == 2

    run(work())


def test_a_window_of_eight_fills_the_events_and_never_beats_them() -> None:
    """Eight in flight over 30 ms with four packets each way: four answers per event, not one more."""

    async def work() -> float:
        loop = asyncio.get_running_loop()
        async with open_connection("bolt?interval=30ms&per_event=4&queue=8", OpenOptions()) as connection:
            transport, decoder = connection.transport, CODEC.decoder(Role.HOST)
            sent = answered = 0
            while answered < 200:
                while sent < 200 and sent - answered < 8:
                    await transport.write(CODEC.encode_command(ECHO, sent))
                    sent += 1
                answered += len(decoder.feed(await transport.read()))
            return loop.time()

    assert run(work()) == pytest.approx((200 / 4 + 1) * 0.03)


@pytest.mark.parametrize("key", ["ledger", "truth"])
def test_a_file_that_cannot_be_written(key: str) -> None:
    async def work() -> None:
        async with open_connection(f"bolt?{key}=/no/such/folder/file", OpenOptions()):
            pass

    with pytest.raises(OutputError, match="cannot write"):
        run(work())
