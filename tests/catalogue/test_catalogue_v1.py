"""The V1 tables, compared with the survey that they were made from, and the payloads of V1 robots."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from sphero_probe.catalogue import (
    DEVICE_NAMES,
    ROBOTS,
    all_rows,
    async_rows,
    commands_of,
    device_by_name,
    lookup,
    notification_row,
    row_by_name,
    rows_of,
)
from sphero_probe.catalogue.gatt import (
    V1_ANTI_DOS_CHARACTERISTIC,
    V1_COMMAND_CHARACTERISTIC,
    V1_CONTROL_SERVICE,
    V1_HANDSHAKE,
    V1_RADIO_SERVICE,
    V1_RESPONSE_CHARACTERISTIC,
    V1_TX_POWER_CHARACTERISTIC,
    V1_WAKE_CHARACTERISTIC,
)
from sphero_probe.catalogue.model import NO_DEVICE, CommandRow, Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Generation
from tests.support.narrowing import known

V1, V2 = Generation.V1, Generation.V2
V1_ROBOTS = [robot for robot in ROBOTS.values() if robot.generation is V1]
EACH_V1_ROBOT = pytest.mark.parametrize("robot", [pytest.param(robot, id=robot.key) for robot in V1_ROBOTS])
LEAST = {0: Risk.MOTION, 1: Risk.WRITE, 2: Risk.WRITE, 3: Risk.MOTION, 4: Risk.PERSIST, 5: Risk.BRICK}
"""Severity in the survey -> the mildest class; a command without a severity counts as the worse one."""
SURVEYED_WITHOUT_ITS_PAGE = {(0x01, 0x03)}
NAMES_ONLY = {
    (0x01, 0x05): "is_page_blank",
    (0x01, 0x06): "erase_user_config",
    (0x02, 0x45): "set_factory_device_mode",
    (0x02, 0x71): "remove_cores",
    (0x02, 0x72): "set_soul_unlock_flags",
    (0x02, 0x73): "reset_soul_block",
    (0x02, 0x75): "read_odometer",
    (0x02, 0x90): "write_persistent_page",
    (0x02, 0xF0): "read_soul_block",
    (0x02, 0xF1): "soul_add_experience",
}
"""Ids that are only in a private header of the maker's iOS SDK [RKCommandList.h]."""
MESSAGE_NAMES_ONLY = {0x20: "soul_block_data_notify", 0x21: "experience_update_notify"}
"""The same for asynchronous messages [RKAsyncPacketCodes.h]."""


class Pair(NamedTuple):
    did: int
    cid: int
    kind: Kind
    severity: int
    read_only: bool
    length: str
    names: tuple[str, ...]


def read_pairs() -> list[Pair]:
    pairs = []
    for line in (
        (Path(__file__).parents[1] / "data" / "pairs_v1.txt").read_text(encoding="utf-8").splitlines()
    ):
        if not line.startswith("#"):
            did, cid, kind, severity, read_only, length, names = line.split()
            pairs.append(
                Pair(
                    NO_DEVICE if did == "--" else int(did, 16),
                    int(cid, 16),
                    Kind(kind),
                    0 if severity == "-" else int(severity),
                    read_only == "ro",
                    length,
                    () if names == "-" else tuple(names.split(",")),
                )
            )
    return pairs


PAIRS = read_pairs()
COMMANDS = [pair for pair in PAIRS if pair.kind is Kind.COMMAND]
MESSAGES = [pair for pair in PAIRS if pair.kind is Kind.NOTIFICATION]


def offenders(is_healthy: Callable[[Pair, CommandRow], bool]) -> list[str]:
    return [
        f"{pair.did:02x}/{pair.cid:02x}"
        for pair in COMMANDS
        if not is_healthy(pair, known(lookup(V1, pair.did, pair.cid, None)))
    ]


def test_the_survey_is_all_there_and_nothing_else() -> None:
    assert (len(COMMANDS), len(MESSAGES)) == (83, 18)
    surveyed = [row for row in all_rows(V1) if (row.did, row.cid) not in NAMES_ONLY]
    assert [(row.did, row.cid) for row in surveyed] == [(pair.did, pair.cid) for pair in COMMANDS]
    messages = [row.cid for row in async_rows(V1) if row.cid not in MESSAGE_NAMES_ONLY]
    assert messages == [pair.cid for pair in MESSAGES]
    assert {row.kind for row in all_rows(V1)} == {Kind.COMMAND}
    assert {(row.did, row.kind, row.risk) for row in async_rows(V1)} == {
        (NO_DEVICE, Kind.NOTIFICATION, Risk.READ)
    }


def test_a_command_only_in_a_header_is_as_dangerous_as_its_name() -> None:
    rows = {(row.did, row.cid): row for row in all_rows(V1) if "iossdk" in row.sources}
    assert {pair: row.name.partition(".")[2] for pair, row in rows.items()} == NAMES_ONLY
    reads = {row.name for row in rows.values() if row.risk is Risk.PERSIST}
    assert reads == {"sphero.read_odometer", "sphero.read_soul_block"}
    assert {row.risk for row in rows.values() if row.name not in reads} == {Risk.BRICK}
    assert all(row.request is None and row.nodes == {} and row.note for row in rows.values())
    messages = {row.cid: row.name for row in async_rows(V1) if "iossdk" in row.sources}
    assert messages == {cid: f"async.{name}" for cid, name in MESSAGE_NAMES_ONLY.items()}


def test_pairs_are_no_less_dangerous_than_surveyed() -> None:
    def dangerous_enough(pair: Pair, row: CommandRow) -> bool:
        if pair.read_only:
            return row.risk is Risk.READ
        return row.risk >= (Risk.BRICK if pair.did == 0x01 else LEAST[pair.severity])

    assert offenders(dangerous_enough) == []


@pytest.mark.parametrize(
    ("name", "risk"),
    [
        pytest.param("core.ping", Risk.READ, id="ping"),
        pytest.param("core.sleep", Risk.MOTION, id="sleep ends the session"),
        pytest.param("core.jump_to_bootloader", Risk.BRICK, id="no way back by itself"),
        pytest.param("bootloader.jump_to_main", Risk.BRICK, id="the whole bootloader"),
        pytest.param("sphero.set_main_led", Risk.WRITE, id="an LED"),
        pytest.param("sphero.roll", Risk.MOTION, id="roll"),
        pytest.param("sphero.save_macro", Risk.PERSIST, id="a macro in flash"),
        pytest.param("sphero.set_config_block", Risk.BRICK, id="configuration"),
        pytest.param("sphero.set_soul_block", Risk.BRICK, id="soul"),
        pytest.param("sphero.erase_orbbasic_storage", Risk.BRICK, id="orbBasic"),
        pytest.param("sphero.abort_macro", Risk.MOTION, id="in no list: the more dangerous"),
    ],
)
def test_risk_of(name: str, risk: Risk) -> None:
    assert known(row_by_name(V1, name)).risk is risk


def test_requests_take_the_length_of_the_survey() -> None:
    def right_length(pair: Pair, row: CommandRow) -> bool:
        if pair.length == "-" or (pair.did, pair.cid) in SURVEYED_WITHOUT_ITS_PAGE:
            return True
        if pair.length == "var":
            assert row.request is not None
            return row.request.fixed_length is None
        assert row.request is not None
        return row.request.accepts(int(pair.length))

    assert offenders(right_length) == []


def test_what_takes_as_many_bytes_as_a_probe_is_withheld() -> None:
    fitting = [row.name for row in all_rows(V1) if row.request and row.request.accepts(11)]
    assert [name for name in fitting if known(row_by_name(V1, name)).risk < Risk.PERSIST] == []


@pytest.mark.parametrize("pair", COMMANDS, ids=lambda pair: f"{pair.did:02x} {pair.cid:02x}")
def test_every_name_of_either_client_finds_the_row(pair: Pair) -> None:
    for name in pair.names:
        row = known(row_by_name(V1, name))
        assert (row.did, row.cid) == (pair.did, pair.cid)


def test_the_names_of_spherov2_are_kept_for_messages() -> None:
    assert {
        pair.cid: row.name
        for pair in MESSAGES
        for row in rows_of(V1, NO_DEVICE, pair.cid)
        if pair.names and row.name != f"async.{pair.names[0]}"
    } == {}


def test_names_of_messages_are_unique_and_dotted() -> None:
    names = [row.name for row in async_rows(V1)]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"async\.[a-z][a-z0-9_]*_notify", name) for name in names)


def test_devices() -> None:
    assert DEVICE_NAMES[V1] == {0x00: "core", 0x01: "bootloader", 0x02: "sphero"}
    assert device_by_name(V1, "Sphero") == 0x02
    assert {row.did for row in all_rows(V1)} == {0, 1, 2}


def test_messages_cannot_be_found_as_commands() -> None:
    assert async_rows(V2) == ()
    assert row_by_name(V1, "async.did_sleep_notify") is None
    assert not {row.name for row in all_rows(V1)} & {row.name for row in async_rows(V1)}


@EACH_V1_ROBOT
def test_a_robot_knows_what_all_know(robot: Robot) -> None:
    places = [(row.did, row.cid) for row in commands_of(robot)]
    assert len(set(places)) == len(places) >= 60
    assert {(0x00, 0x01), (0x00, 0x02), (0x00, 0x20), (0x00, 0x22), (0x02, 0x20), (0x02, 0x30)} <= set(places)
    assert all(row.nodes[robot.key] == (1,) for row in commands_of(robot))
    messages = {row.cid for row in async_rows(V1) if robot.key in row.nodes}
    assert {0x01, 0x03, 0x05, 0x07, 0x0C, 0x14} <= messages


@pytest.mark.parametrize(
    ("name", "robots"),
    [
        pytest.param("sphero.get_sku", {"sprk-plus", "ollie", "bb8"}, id="SKU"),
        pytest.param("core.get_factory_config_block_crc", {"sprk-plus", "bb8"}, id="CRC"),
        pytest.param("core.get_auto_reconnect", {"sphero", "sprk"}, id="classic Bluetooth"),
        pytest.param("sphero.get_soul_block", {"sphero", "sprk"}, id="soul"),
    ],
)
def test_what_only_some_robots_know(name: str, robots: set[str]) -> None:
    assert set(known(row_by_name(V1, name)).nodes) == robots


@pytest.mark.parametrize(
    ("generation", "did", "cid", "robot", "name"),
    [
        pytest.param(V1, None, 0x07, "bb8", "async.collision_detected_notify", id="V1"),
        pytest.param(V1, None, 0x14, None, "async.did_sleep_notify", id="V1, any robot"),
        pytest.param(V1, None, 0x0E, "ollie", "async.level_up_notify", id="V1, not among its own"),
        pytest.param(V1, None, 0x12, "bb8", None, id="V1, in no document"),
        pytest.param(V1, 0x00, 0x20, "bb8", "core.get_power_state", id="V1 with a device"),
        pytest.param(V2, 0x13, 0x19, "bolt", "power.will_sleep_notify", id="V2"),
        pytest.param(V2, 0x13, 0x1F, "bolt", "power.battery_state_changed", id="V2, a command there too"),
        pytest.param(V2, 0x13, 0x10, "mini", "power.get_battery_percentage", id="V2, a command only"),
        pytest.param(V2, 0x13, 0xEE, "mini", None, id="V2, unknown"),
        pytest.param(V2, None, 0x03, "mini", None, id="V2 without a device"),
    ],
)
def test_notification_row(
    generation: Generation, did: int | None, cid: int, robot: str | None, name: str | None
) -> None:
    row = notification_row(generation, did, cid, ROBOTS[robot] if robot else None)
    assert (row and row.name) == name


@pytest.mark.parametrize(
    ("message", "payload", "fields", "units"),
    [
        pytest.param(0x01, "03", {"state": "low"}, {}, id="power"),
        pytest.param(0x01, "09", {"state": 9}, {}, id="power, unlisted"),
        pytest.param(0x02, "6f6b0d0a", {"text": "ok\r\n"}, {}, id="level 1 diagnostics"),
        pytest.param(0x03, "0001ffff", {"values": [1, -1]}, {}, id="streaming, masks not known"),
        pytest.param(0x04, "00ff10", {"block": "00ff10"}, {}, id="configuration block, raw"),
        pytest.param(0x05, "", {}, {}, id="will sleep"),
        pytest.param(0x06, "05ff0102", {"marker": 5, "macro": 255, "command_number": 258}, {}, id="macro"),
        pytest.param(
            0x07,
            "1000f00000000200100020ff000003e8",
            {
                "acceleration_x": 1.0,
                "acceleration_y": -1.0,
                "acceleration_z": 0.0,
                "axes": ["y_axis"],
                "power_x": 16,
                "power_y": 32,
                "speed": 255,
                "time": 1000,
            },
            {"acceleration_x": "g", "acceleration_y": "g", "acceleration_z": "g", "time": "ms"},
            id="collision",
        ),
        pytest.param(0x08, "6869", {"text": "hi"}, {}, id="orbBasic print"),
        pytest.param(0x09, "6f6f707300", {"text": "oops"}, {}, id="orbBasic error text"),
        pytest.param(0x0A, "000a07", {"error": "000a07"}, {}, id="orbBasic error, binary"),
        pytest.param(0x0B, "06", {"result": "success"}, {}, id="self level"),
        pytest.param(0x0C, "21", {"axes": ["max_plus_x", "max_minus_z"]}, {}, id="gyro, two bits"),
        pytest.param(
            0x0C,
            "3f",
            {
                "axes": [
                    "max_plus_x",
                    "max_minus_x",
                    "max_plus_y",
                    "max_minus_y",
                    "max_plus_z",
                    "max_minus_z",
                ]
            },
            {},
            id="gyro, all axes",
        ),
        pytest.param(0x0D, "53", {"block": "53"}, {}, id="soul"),
        pytest.param(0x0E, "00020101", {"level": 2, "attribute_points": 257}, {}, id="level up"),
        pytest.param(0x0F, "ff", {"shield": 100.0}, {"shield": "%"}, id="shield, all"),
        pytest.param(0x0F, "33", {"shield": 20.0}, {"shield": "%"}, id="shield, a fifth"),
        pytest.param(0x10, "00", {"experience": 0.0}, {"experience": "%"}, id="XP, none"),
        pytest.param(0x11, "66", {"boost": 40.0}, {"boost": "%"}, id="boost, two fifths"),
        pytest.param(0x14, "", {}, {}, id="did sleep"),
    ],
)
def test_notifications_are_decoded(
    message: int, payload: str, fields: dict[str, Any], units: dict[str, str]
) -> None:
    decoded = known(known(notification_row(V1, None, message, ROBOTS["sphero"])).response).decode(
        bytes.fromhex(payload)
    )
    assert decoded == (fields, units, b"", "")


def test_a_share_is_what_it_was() -> None:
    layout = known(notification_row(V1, None, 0x0F, None)).response
    for share in range(256):
        assert layout is not None
        assert layout.encode(layout.decode(bytes([share])).fields) == bytes([share])


@pytest.mark.parametrize(
    ("name", "payload", "fields"),
    [
        pytest.param(
            "core.get_power_state",
            "010202ef000a0100",
            {
                "record_version": 1,
                "state": "ok",
                "battery_voltage": 7.51,
                "charges": 10,
                "time_since_charge": 256,
            },
            id="power",
        ),
        pytest.param(
            "core.get_versions",
            "0103010408330000",
            {
                "record_version": 1,
                "model": 3,
                "hardware": 1,
                "main_app_major": 4,
                "main_app_minor": 8,
                "bootloader": 0x33,
                "orbbasic": 0,
                "overlay": 0,
            },
            id="versions, 8 bytes",
        ),
        pytest.param(
            "core.get_bluetooth_info",
            b"BB-1234".ljust(16, b"\0").hex() + b"C601020304AB".hex() + "00524742",
            {"name": "BB-1234", "address": "C601020304AB", "id_colours": "00524742"},
            id="Bluetooth with colours",
        ),
        pytest.param(
            "sphero.read_locator",
            "fff600640001ffff000a",
            {"x": -10, "y": 100, "velocity_x": 1, "velocity_y": -1, "speed": 10},
            id="locator",
        ),
        pytest.param(
            "sphero.get_persistent_options",
            "00000109",
            {
                "options": [
                    "disable_sleep_in_charger",
                    "enable_tail_light_always_on",
                    "enable_gyro_max_notify",
                ]
            },
            id="options",
        ),
        pytest.param("sphero.get_main_led", "ff8000", {"red": 255, "green": 128, "blue": 0}, id="colour"),
        pytest.param("sphero.get_macro_status", "020102", {"macro": 2, "command_number": 258}, id="macro"),
    ],
)
def test_what_robots_answer_is_decoded(name: str, payload: str, fields: dict[str, Any]) -> None:
    decoded = known(known(row_by_name(V1, name)).response).decode(bytes.fromhex(payload))
    assert decoded.fields == fields
    assert decoded.problem == ""


def test_versions_may_be_two_bytes_longer() -> None:
    decoded = known(known(row_by_name(V1, "core.get_versions")).response).decode(bytes(range(1, 11)))
    assert decoded.fields["api_version"] == [9, 10]
    assert decoded.problem == ""


def test_level_two_diagnostics_are_of_the_documented_length() -> None:
    layout = known(row_by_name(V1, "core.run_level_two_diagnostics")).response
    assert layout is not None
    assert layout.fixed_length == 88
    assert layout.decode(bytes(35) + b"\x07" + bytes(52)).fields["boot_reason"] == 7


def test_ble_constants() -> None:
    base = "22bb746f-{}-7554-2d6f-726568705327"
    assert (
        (base.format("2bbd"), b"011i3"),
        (base.format("2bb2"), b"\7"),
        (base.format("2bbf"), b"\1"),
    ) == V1_HANDSHAKE
    assert {base.format(word): word for word in ("2bb0", "2ba0", "2bbd", "2bb2", "2bbf", "2ba1", "2ba6")} == {
        V1_RADIO_SERVICE: "2bb0",
        V1_CONTROL_SERVICE: "2ba0",
        V1_ANTI_DOS_CHARACTERISTIC: "2bbd",
        V1_TX_POWER_CHARACTERISTIC: "2bb2",
        V1_WAKE_CHARACTERISTIC: "2bbf",
        V1_COMMAND_CHARACTERISTIC: "2ba1",
        V1_RESPONSE_CHARACTERISTIC: "2ba6",
    }


def test_a_pair_of_one_generation_is_none_of_the_other() -> None:
    assert rows_of(V1, 0x13, 0x10) == rows_of(V2, 0x00, 0x01) == ()
