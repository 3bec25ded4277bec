"""Notifications: decoded, delivered to all listeners, bounded, and ending in every way they should."""

import asyncio
import gc

import pytest

from sphero_probe import ConnectedRobot, connect
from sphero_probe.errors import LinkLostError
from tests.support.virtual_clock import run

MASK = bytes.fromhex("0032000000e000")
"""Every 50 ms, one frame each, the three accelerometer axes."""


async def stream(robot: ConnectedRobot, mask: bytes = MASK) -> None:
    await robot.send("sensor.set_sensor_streaming_mask", payload=mask)


def test_a_sensor_stream_is_named_by_the_masks_that_were_set() -> None:
    async def work() -> None:
        async with connect("fake:bolt", consent=["write"]) as robot:
            heard = robot.notifications(seconds=1.02)
            await stream(robot)
            got = [notification async for notification in heard]
            assert len(got) == 20
            assert {packet.kind for packet in got} == {"notification"}
            assert {packet.name for packet in got} == {"sensor.sensor_streaming_data_notify"}
            assert set(got[0].fields) == {"accelerometer_x", "accelerometer_y", "accelerometer_z"}
            assert abs(got[0].accelerometer_z - 1) < 0.1
            assert got[0].raw.startswith(b"\x8d")
            assert heard.dropped == 0

    run(work())


def test_listening_starts_with_the_call_not_with_the_loop() -> None:
    async def work() -> None:
        async with connect("fake:bolt", consent=["write"]) as robot:
            heard = robot.notifications()
            await stream(robot)
            await asyncio.sleep(0.5)
            await stream(robot, bytes(7))
            for _ in range(9):
                await anext(heard)

    run(work())


def test_a_slow_listener_loses_the_oldest_and_is_told() -> None:
    async def work() -> None:
        async with connect("fake:bolt", consent=["write"]) as robot:
            slow, quick = robot.notifications(queue=3), robot.notifications()
            await stream(robot)
            await asyncio.sleep(1.02)
            await stream(robot, bytes(7))
            assert slow.dropped == 17
            newest = [await anext(slow) for _ in range(3)]
            everything = [await anext(quick) for _ in range(20)]
            assert newest == everything[-3:]

    run(work())


def test_it_listens_during_and_after_a_sweep() -> None:
    async def work() -> None:
        async with connect("fake:bolt?latency=15ms", consent=["write"]) as robot:
            heard = robot.notifications()
            await stream(robot)
            found = await robot.sweep("power").collect()
            during = [note for note in found.notes if note.kind == "notification"]
            assert len(during) > 5  # the run notes them too, and names their values
            assert all("'accelerometer_x'" in str(note.data["fields"]) for note in during)
            for _ in during:
                await anext(heard)
            await asyncio.sleep(1)
            for _ in range(15):
                await anext(heard)

    run(work())


def test_leaving_ends_every_listener() -> None:
    async def work() -> None:
        async with connect("fake:bolt") as robot:
            heard = robot.notifications()
            listening = asyncio.create_task(anext(heard, None))
            await asyncio.sleep(1)
        assert await listening is None

    run(work())


def test_a_lost_robot_ends_it_with_an_error_after_what_was_heard() -> None:
    async def work() -> None:
        async with connect("fake:bolt?disconnect_after=3", consent=["write"]) as robot:
            heard = robot.notifications()
            await stream(robot)
            await asyncio.sleep(0.11)
            await robot.send("power.wake")
            await robot.send("power.wake")
            with pytest.raises(LinkLostError):
                await robot.send("power.wake")
            await asyncio.sleep(0.01)
            assert [await anext(heard) for _ in range(2)]
            with pytest.raises(LinkLostError):
                await anext(heard)
            await robot.reconnect()
            again = robot.notifications(seconds=0.12)
            await stream(robot)
            assert len([notification async for notification in again]) == 2

    run(work())


def test_a_reconnect_of_a_sweep_does_not_end_it() -> None:
    async def work() -> None:
        async with connect("fake:bolt?disconnect_after=70", consent=["write"]) as robot:
            heard = robot.notifications()
            assert (await robot.sweep("power").collect()).complete
            await stream(robot)
            assert (await anext(heard)).name == "sensor.sensor_streaming_data_notify"

    run(work())


def test_a_listener_that_was_dropped_is_forgotten() -> None:
    async def work() -> None:
        async with connect("fake:bolt", consent=["write"]) as robot:
            await stream(robot)
            async for _ in robot.notifications():
                break
            gc.collect()
            assert not robot._dispatcher._listeners
            closed = robot.notifications()
            await closed.aclose()
            with pytest.raises(StopAsyncIteration):
                await anext(closed)

    run(work())
