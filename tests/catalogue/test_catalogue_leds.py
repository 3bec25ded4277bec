"""The commands that set LEDs, and the LEDs that a command sets."""

import pytest

from sphero_probe.catalogue import ROBOTS, lookup
from sphero_probe.catalogue.leds import led_commands, leds_set
from sphero_probe.catalogue.model import Robot
from sphero_probe.protocol.packets import Command
from tests.support.narrowing import known

RED, BLUE, GREY = (255, 0, 0), (0, 0, 255), (1, 2, 3)
TABLES = {robot.key: robot.leds for robot in ROBOTS.values() if robot.leds}
WITH_LEDS = [pytest.param(ROBOTS[key], id=key) for key in TABLES]
UNMASKED = [pytest.param(ROBOTS[key], id=key) for key, table in TABLES.items() if table.mask_bytes == 0]
MASKED = [pytest.param(ROBOTS[key], id=key) for key, table in TABLES.items() if table.mask_bytes]


@pytest.mark.parametrize(
    ("robot", "wanted", "off", "commands"),
    [
        pytest.param("bolt", {"front": RED}, False, ["1a 1c 07ff0000"], id="mask of 8 bits"),
        pytest.param(
            "bolt", {"back": BLUE, "front": RED}, False, ["1a 1c 3fff00000000ff"], id="two LEDs, one command"
        ),
        pytest.param("bolt", {"back": BLUE}, True, ["1a 1c 3f0000000000ff"], id="the others off"),
        pytest.param("mini", {"aiming": GREY}, False, ["1a 0e 000103"], id="one channel: the brightest"),
        pytest.param(
            "rvr", {"headlights": GREY}, False, ["1a 1a 0000003f010203010203"], id="an alias of two"
        ),
        pytest.param("bb8", {"front": RED}, False, ["02 20 ff000000"], id="V1 main LED, not kept"),
        pytest.param("bb8", {"main": RED}, False, ["02 20 ff000000"], id="V1 main LED by its name"),
        pytest.param("ollie", {"back": GREY}, False, ["02 21 03"], id="V1 back LED"),
        pytest.param(
            "sphero", {"back": BLUE, "front": RED}, False, ["02 20 ff000000", "02 21 ff"], id="V1 both"
        ),
        pytest.param("sprk", {"back": GREY}, True, ["02 20 00000000", "02 21 03"], id="V1 the other off"),
        pytest.param("sprk-plus", {}, True, ["02 20 00000000", "02 21 00"], id="V1 all off"),
        pytest.param("bb8", {}, False, [], id="V1 nothing wanted"),
        pytest.param("bolt", {}, False, [], id="nothing wanted"),
        pytest.param("bolt", {"belly": RED}, False, [], id="no such LED"),
        pytest.param("lmq", {"front": RED}, True, [], id="no LEDs known"),
    ],
)
def test_led_commands(
    robot: str, wanted: dict[str, tuple[int, int, int]], off: bool, commands: list[str]
) -> None:
    made = led_commands(ROBOTS[robot], wanted, off=off)
    assert [f"{did:02x} {cid:02x} {payload.hex()}" for did, cid, payload, *_ in made] == commands
    assert {command.target for command in made} <= {None}


@pytest.mark.parametrize("robot", WITH_LEDS)
def test_every_command_is_one_of_the_robot_and_fits_its_layout(robot: Robot) -> None:
    assert robot.leds is not None
    for group in robot.leds.groups:
        for name in (group.name, *group.aliases):
            for off in (False, True):
                for command in led_commands(robot, {name: GREY}, off=off):
                    row = known(lookup(robot.generation, command.did, command.cid, robot))
                    assert robot.key in row.nodes
                    assert row.request is not None
                    assert row.request.accepts(len(command.payload))


@pytest.mark.parametrize("robot", UNMASKED)
def test_without_a_mask_every_led_has_its_command(robot: Robot) -> None:
    assert robot.leds is not None
    assert all(group.cid is not None for group in robot.leds.groups)
    assert robot.leds.cid == robot.leds.groups[0].cid
    assert robot.leds.node is None


@pytest.mark.parametrize("robot", MASKED)
def test_with_a_mask_no_led_has_a_command_of_its_own(robot: Robot) -> None:
    table = robot.leds
    assert table is not None
    assert all(group.cid is None and group.tail == b"" for group in table.groups)
    channels = {bit: 0 for group in table.groups for bit in group.bits}
    for group in table.groups:
        if "front" in (group.name, *group.aliases):
            channels |= zip(group.bits, RED if len(group.bits) == 3 else [max(RED)] * 99, strict=False)
    mask = sum(1 << bit for bit in channels).to_bytes(table.mask_bytes, "big")
    payload = mask + bytes(channels[bit] for bit in sorted(channels))
    assert led_commands(robot, {"front": RED}, off=True) == (Command(table.did, table.cid, payload),)


@pytest.mark.parametrize(
    ("robot", "command", "leds"),
    [
        pytest.param(
            "bolt-plus",
            "1a 1c 3fff0000ff0000",
            {"front": "ff0000", "back": "ff0000"},
            id="the worked example of the description of BOLT+",
        ),
        pytest.param("bolt-plus", "1a 1c 3800ff00", {"back": "00ff00"}, id="its back LED"),
        pytest.param("bolt", "1a 1c 0580ff", {"front": "red 128 blue 255"}, id="some channels of an LED"),
        pytest.param("mini", "1a 0e 000103", {"aiming": 3}, id="one channel"),
        pytest.param("mini", "1a 0e 000f01020304", {"aiming": 1, "body": "020304"}, id="two LEDs"),
        pytest.param(
            "rvr",
            "1a 1a 0000003f010203010203",
            {"right_headlight": "010203", "left_headlight": "010203"},
            id="RVR",
        ),
        pytest.param("bb8", "02 20 ff000001", {"main": "ff0000"}, id="V1"),
        pytest.param("bb8", "02 20 ff0000", {"main": "ff0000"}, id="V1, not told to be kept"),
        pytest.param("bb8", "02 21 07", {"back": 7}, id="V1 back LED"),
        pytest.param("bb8", "02 20 ff00", None, id="V1, too short"),
        pytest.param("bolt", "1a 1c 3fff0000ff00", None, id="a value is missing"),
        pytest.param("bolt", "1a 1c 3fff0000ff000000", None, id="a value too many"),
        pytest.param("bolt", "1a 1c 40ff", None, id="a bit of no LED"),
        pytest.param("bolt", "1a 1c 00", None, id="an empty mask"),
        pytest.param("bolt", "1a 1c ", None, id="no payload"),
        pytest.param("rvr", "1a 1c 3fff0000ff0000", None, id="the command of another robot"),
        pytest.param("bolt", "13 0d ", None, id="not an LED command"),
        pytest.param("lmq", "1a 1c 3fff0000ff0000", None, id="no LEDs known"),
    ],
)
def test_leds_set(robot: str, command: str, leds: dict[str, object] | None) -> None:
    did, cid, payload = command.split(" ")
    assert leds_set(ROBOTS[robot], Command(int(did, 16), int(cid, 16), bytes.fromhex(payload))) == leds


@pytest.mark.parametrize("robot", WITH_LEDS)
def test_led_commands_read_back_as_the_same_leds(robot: Robot) -> None:
    groups = known(robot.leds).groups
    for group in groups:
        leds: dict[str, object] = {}
        for command in led_commands(robot, {group.name: GREY}, off=True):
            leds |= known(leds_set(robot, command))
        assert leds.keys() == {other.name for other in groups}
        assert leds.pop(group.name) == ("010203" if len(group.bits) == 3 else max(GREY))
        assert set(leds.values()) <= {"000000", 0}
