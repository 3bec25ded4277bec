"""A connected robot: identity, firmware, LEDs, two robots at once."""

import asyncio
from pathlib import Path

import pytest

from sphero_probe import ConnectedRobot, Consent, Generation, Risk, connect, discover
from sphero_probe.catalogue import ROBOTS
from sphero_probe.errors import RefusedByPolicyError, UsageError
from tests.support.virtual_clock import run


def test_identity() -> None:
    async def work() -> None:
        async with connect("fake:rvr", consent="write") as robot:
            assert robot.name == "RV-B9D8"
            assert robot.address == "fake:rvr"
            assert robot.model is ROBOTS["rvr"]
            assert robot.generation is Generation.V2
            assert robot.consent == Consent.of(["write"])
            assert await robot.firmware() == {"primary": "7.8.434", "secondary": "6.5.119"}
            assert "left_headlight" in robot.leds
            assert repr(robot) == "<ConnectedRobot 'RV-B9D8', Sphero RVR>"

    run(work())


def test_five_lines_sweep_the_built_in_robot() -> None:
    async def main() -> list[str | None]:
        async with connect("fake:bolt-plus") as robot:
            return [finding.name async for finding in robot.sweep(did=0x13) if finding.outcome == "exists"]

    assert "power.get_battery_percentage" in run(main())


@pytest.mark.parametrize("color", ["ff8000", "#f80", (0xFF, 0x88, 0x00)])
def test_leds_need_no_consent_and_give_none(color: str | tuple[int, int, int]) -> None:
    async def work() -> None:
        async with connect("fake:bolt-plus") as robot:
            answer = await robot.set_led("Front", color)
            assert answer.ok
            assert answer.command.payload[:2] == b"\x07\xff"
            assert Risk.WRITE not in robot.consent.allowed
            with pytest.raises(RefusedByPolicyError):  # not even the very same bytes
                await robot.send(answer.command)

    run(work())


def test_leds_with_a_command_each() -> None:
    async def work() -> None:
        async with connect("fake:bb8") as robot:
            answers = await robot.set_leds({"front": "00ff00"}, off=True)
            assert all(answer.ok for answer in answers)

    run(work())


@pytest.mark.parametrize(
    ("colors", "said"),
    [
        ({"frnt": "f00"}, "no LED on Sphero BOLT\\+: 'frnt'"),
        ({"front": "rot"}, "'rot' is not a colour"),
        ({"front": (1, 2, 256)}, "larger than 0xff"),
        ({}, "no LED is named"),
    ],
)
def test_invalid_leds_are_a_usage_error(colors: dict[str, str | tuple[int, int, int]], said: str) -> None:
    async def work() -> None:
        async with connect("fake:bolt-plus") as robot:
            with pytest.raises(UsageError, match=said):
                await robot.set_leds(colors)

    run(work())


def test_several_tasks_may_send_while_leds_are_set() -> None:
    async def work() -> None:
        async with connect("fake:bolt-plus?latency=10ms") as robot:

            async def refused() -> None:
                with pytest.raises(RefusedByPolicyError):
                    await robot.send("user_io.set_all_leds_with_8_bit_mask", payload=b"\x07\0\0\1")

            await asyncio.gather(
                robot.set_led("front", "010203"), refused(), robot.set_led("front", "010203")
            )

    run(work())


def test_two_robots_at_once_are_two_conversations() -> None:
    async def commands(device: str) -> set[tuple[int, int]]:
        async with connect(device) as robot:
            findings = (await robot.sweep("power").collect()).existing
        return {(finding.command.did, finding.command.cid) for finding in findings}

    async def both() -> list[set[tuple[int, int]]]:
        return list(await asyncio.gather(commands("fake:bolt-plus"), commands("fake:rvr?latency=15ms")))

    bolt, rvr = run(both())
    assert bolt == run(commands("fake:bolt-plus"))
    assert rvr == run(commands("fake:rvr?latency=15ms"))
    assert bolt != rvr


def test_leaving_stops_motors_that_were_allowed(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"

    async def drive(robot: ConnectedRobot) -> None:
        await robot.send("drive.set_raw_motors", payload=bytes([1, 99, 1, 99]))

    async def work() -> None:
        async with connect(f"fake:rvr?ledger={ledger}", consent=["motion"]) as robot:
            await drive(robot)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run(work())
    lines = ledger.read_text(encoding="utf-8").splitlines()
    assert '"payload":"01630163"' in lines[0]
    assert '"payload":"00000000"' in lines[-1]


def test_discover_maps_a_whole_robot_in_one_call() -> None:
    found = run(discover("fake:mini"))
    assert found.complete
    assert found.heading is not None
    assert found.heading.robot == "mini"
    assert found.find("power.get_battery_voltage") is not None
    assert {finding.command.did for finding in found.existing} >= {0x10, 0x11, 0x13}
