"""The tables, compared with the survey that they were made from, and the look-ups."""

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from sphero_probe.catalogue import (
    BRICK_DEVICES,
    DEVICE_NAMES,
    NO_EMPTY_PROBE_DEVICES,
    PERSIST_DEVICES,
    ROBOTS,
    all_rows,
    async_rows,
    close_names,
    commands_of,
    device_by_name,
    lookup,
    robot_by_prefix,
    robot_by_word,
    row_by_name,
    rows_of,
)
from sphero_probe.catalogue.model import AnswerStyle, CommandRow, Kind, Robot
from sphero_probe.catalogue.payload.enums import VALUE_NAMES
from sphero_probe.catalogue.provenance import SOURCES
from sphero_probe.catalogue.risk import Risk
from sphero_probe.protocol.packets import Generation
from tests.support.narrowing import known

V2 = Generation.V2
V2_ROBOTS = [robot for robot in ROBOTS.values() if robot.generation is V2]
LEAST = {1: Risk.WRITE, 2: Risk.WRITE, 3: Risk.MOTION, 4: Risk.PERSIST, 5: Risk.BRICK}
HARMLESS_IN_SPITE_OF_THE_SURVEY = {(0x10, 0x09)}
"""It only makes the robot respond with the code that it is given."""
MOVES_ON_ANOTHER_ROBOT = {(0x17, 0x25)}
"""A read on R2-D2; its severity is that of Lightning McQueen's meaning."""
NOT_IN_THE_SURVEY = {(0x13, 0x11), (0x13, 0x1E)}
"""Seen in captures, in no published list; sent to a Mini by the maker's app [spherov2.js]."""


class Pair(NamedTuple):
    did: int
    cid: int
    kind: Kind
    severity: int
    read_only: bool
    length: str


def read_pairs() -> list[Pair]:
    pairs = []
    for line in (
        (Path(__file__).parents[1] / "data" / "pairs_v2.txt").read_text(encoding="utf-8").splitlines()
    ):
        if not line.startswith("#"):
            did, cid, kind, severity, read_only, length = line.split()
            number = 0 if severity == "-" else int(severity)
            pairs.append(Pair(int(did, 16), int(cid, 16), Kind(kind), number, read_only == "ro", length))
    return pairs


PAIRS = read_pairs()
EACH_ROBOT = pytest.mark.parametrize(
    "robot", [pytest.param(robot, id=robot.key) for robot in ROBOTS.values()]
)
EACH_V2_ROBOT = pytest.mark.parametrize("robot", [pytest.param(robot, id=robot.key) for robot in V2_ROBOTS])


def at(text: str) -> tuple[int, int]:
    did, cid = text.split("/")
    return int(did, 16), int(cid, 16)


def test_the_survey_is_all_there() -> None:
    kinds = Counter(pair.kind for pair in PAIRS)
    assert len({(pair.did, pair.cid) for pair in PAIRS}) == len(PAIRS) == 391
    assert (kinds[Kind.COMMAND], kinds[Kind.NOTIFICATION]) == (329, 62)
    assert sum(pair.read_only for pair in PAIRS) == 103


def test_no_pair_is_made_up() -> None:
    known = {(row.did, row.cid) for row in all_rows(V2)}
    assert known - {(pair.did, pair.cid) for pair in PAIRS} == NOT_IN_THE_SURVEY


def offenders(is_healthy: Callable[[Pair, tuple[CommandRow, ...]], object]) -> list[str]:
    return [
        f"{pair.did:02x}/{pair.cid:02x}"
        for pair in PAIRS
        if not is_healthy(pair, rows_of(V2, pair.did, pair.cid))
    ]


def test_pairs_have_the_kind_of_the_survey() -> None:
    assert offenders(lambda pair, rows: rows and rows[0].kind is pair.kind) == []


def test_pairs_are_no_less_dangerous_than_surveyed() -> None:
    def dangerous_enough(pair: Pair, rows: tuple[CommandRow, ...]) -> bool | str:
        place = (pair.did, pair.cid)
        risk = known(lookup(V2, *place, None)).risk
        if pair.kind is Kind.NOTIFICATION:
            return {row.risk for row in rows} == {Risk.READ}
        if pair.read_only:
            return {row.risk for row in rows} == {Risk.READ}
        if place in HARMLESS_IN_SPITE_OF_THE_SURVEY:
            return risk is Risk.READ and rows[0].note
        if pair.did in BRICK_DEVICES[V2]:
            return risk is Risk.BRICK
        return risk >= LEAST.get(pair.severity, Risk.WRITE)

    assert offenders(dangerous_enough) == []


def test_reads_have_no_severity() -> None:
    def harmless(pair: Pair, rows: tuple[CommandRow, ...]) -> bool:
        place = (pair.did, pair.cid)
        if pair.kind is Kind.NOTIFICATION or all(row.risk is not Risk.READ for row in rows):
            return True
        if place in MOVES_ON_ANOTHER_ROBOT:
            return any(row.risk is Risk.MOTION for row in rows)
        return pair.severity < 2 and (pair.read_only or place in HARMLESS_IN_SPITE_OF_THE_SURVEY)

    assert offenders(harmless) == []


def test_requests_have_the_length_of_the_survey() -> None:
    def right_length(pair: Pair, rows: tuple[CommandRow, ...]) -> bool:
        if pair.length == "-":
            return True
        assert rows[0].request is not None
        fixed = rows[0].request.fixed_length
        return fixed is None if pair.length == "var" else fixed == int(pair.length)

    assert offenders(right_length) == []


@pytest.mark.parametrize(
    ("place", "risk"),
    [
        pytest.param("13/00", Risk.BRICK, id="deep sleep"),
        pytest.param("13/01", Risk.MOTION, id="sleep"),
        pytest.param("13/0d", Risk.READ, id="wake"),
        pytest.param("16/07", Risk.MOTION, id="drive"),
        pytest.param("16/42", Risk.WRITE, id="stop"),
        pytest.param("19/03", Risk.PERSIST, id="rename"),
        pytest.param("1a/1c", Risk.WRITE, id="LEDs"),
        pytest.param("1a/35", Risk.BRICK, id="delete animations"),
        pytest.param("1d/0d", Risk.READ, id="a read among the firmware commands"),
        pytest.param("fe/01", Risk.BRICK, id="a query that no list calls harmless"),
    ],
)
def test_risk_of(place: str, risk: Risk) -> None:
    assert known(lookup(V2, *at(place), None)).risk is risk


def test_no_documented_request_takes_the_lengths_that_sweeps_use() -> None:
    lengths = {row.request.fixed_length for row in all_rows(V2) if row.request is not None}
    assert not lengths & {11, 13}


@pytest.mark.parametrize("generation", list(Generation))
def test_names_are_unique_and_dotted(generation: Generation) -> None:
    names = [row.name for row in all_rows(generation)]
    assert len(set(names)) == len(names)
    for row in all_rows(generation):
        assert re.fullmatch(r"[a-z][a-z0-9_]*\.[a-z][a-z0-9_]*", row.name)
        assert row.name.startswith(f"{DEVICE_NAMES[generation][row.did]}.")
        assert all(re.fullmatch(r"[a-z][a-z0-9_]*", alias) for alias in row.aliases)


@pytest.mark.parametrize("generation", list(Generation))
def test_rows_are_complete(generation: Generation) -> None:
    for row in all_rows(generation) + async_rows(generation):
        assert row.generation is generation
        assert row.sources
        assert set(row.sources) <= SOURCES.keys()
        assert row.name.partition(".")[2] not in row.aliases
        assert row.kind is Kind.COMMAND or row.request is None is row.sample
        for key, nodes in row.nodes.items():
            assert set(nodes) <= set(ROBOTS[key].nodes)
            assert ROBOTS[key].generation is generation
        if row.sample is not None:
            assert row.request is not None
            assert row.request.accepts(len(row.sample))


def test_every_layout_parses_and_every_set_of_names_is_used() -> None:
    rows = [row for generation in Generation for row in all_rows(generation) + async_rows(generation)]
    layouts = [layout for row in rows for layout in (row.request, row.response) if layout is not None]
    used = {field.values for layout in layouts for field in layout.fields}
    assert used - {""} == set(VALUE_NAMES)


def test_rows_come_in_order_and_are_found_by_pair() -> None:
    rows = all_rows(V2)
    assert [(row.did, row.cid) for row in rows] == sorted((row.did, row.cid) for row in rows)
    assert all(row in rows_of(V2, row.did, row.cid) for row in rows)
    assert rows_of(V2, 0x13, 0xEE) == ()


@pytest.mark.parametrize(
    ("robot", "place", "name"),
    [
        pytest.param("r2d2", "17/25", "animatronic.get_leg_action", id="a read on R2-D2"),
        pytest.param("lmq", "17/25", "animatronic.set_shoulder_action", id="moves Lightning McQueen"),
        pytest.param(
            "bolt", "17/25", "animatronic.set_shoulder_action", id="a stranger gets the dangerous one"
        ),
        pytest.param(None, "17/25", "animatronic.set_shoulder_action", id="no robot gets the dangerous one"),
        pytest.param("r2q5", "17/2a", "animatronic.enable_leg_action_notify", id="R2-Q5"),
        pytest.param("lmq", "17/2a", "animatronic.enable_shoulder_action_complete", id="Lightning McQueen"),
        pytest.param("mini", "11/28", "system_info.get_three_character_sku", id="Mini's SKU"),
        pytest.param("lmq", "11/28", "system_info.get_sku_lmq", id="Lightning McQueen's SKU"),
        pytest.param("bolt", "13/1f", "power.get_charger_state", id="a command on BOLT"),
        pytest.param("rvr", "13/10", "power.get_battery_percentage", id="one meaning"),
        pytest.param("bb9e", "13/10", "power.get_battery_percentage", id="not among its own"),
        pytest.param("rvr", "13/11", "power.awake_notify", id="seen in captures only"),
    ],
)
def test_lookup_as_the_robot_understands_it(robot: str | None, place: str, name: str) -> None:
    assert known(lookup(V2, *at(place), ROBOTS[robot] if robot else None)).name == name


def test_lookup_of_the_unknown() -> None:
    assert lookup(V2, 0x13, 0xEE, ROBOTS["bolt"]) is None
    assert lookup(V2, 0x1B, 0x00, None) is None


@EACH_V2_ROBOT
def test_a_robot_has_one_meaning_per_pair(robot: Robot) -> None:
    places = Counter((row.did, row.cid) for row in commands_of(robot))
    assert set(places.values()) == {1}
    assert all(known(lookup(V2, *place, robot)).nodes[robot.key] for place in places)
    assert {(0x10, 0x00), (0x11, 0x00), (0x13, 0x01), (0x13, 0x0D), (0x16, 0x07)} <= set(places)


@pytest.mark.parametrize(
    ("robot", "place", "nodes"),
    [
        pytest.param("bolt", "16/07", (2,), id="BOLT drives on its second node"),
        pytest.param("bolt", "1a/1c", (1,), id="BOLT LEDs"),
        pytest.param("bolt", "11/00", (1, 2), id="both BOLT nodes have a version"),
        pytest.param("bolt", "11/03", (1,), id="node not told: the primary"),
        pytest.param("bolt-plus", "16/07", (1,), id="BOLT+ has one node"),
        pytest.param("bolt-plus", "10/00", (1,), id="BOLT+ echoes on it"),
        pytest.param("bolt-plus", "13/10", (1,), id="BOLT+ battery, a candidate"),
        pytest.param("rvr", "10/00", (1, 2), id="both RVR nodes echo"),
        pytest.param("rvr", "16/32", (2,), id="SDK drive command"),
        pytest.param("rvr", "18/53", (2,), id="SDK encoder command"),
        pytest.param("rvr", "18/23", (1,), id="RVR colour sensor"),
        pytest.param("rvr", "10/09", (1, 2), id="RVR error on demand"),
        pytest.param("mini", "16/07", (1,), id="Mini"),
    ],
)
def test_nodes(robot: str, place: str, nodes: tuple[int, ...]) -> None:
    assert known(lookup(V2, *at(place), ROBOTS[robot])).nodes[robot] == nodes


@pytest.mark.parametrize(
    ("task", "place", "node"),
    [
        pytest.param("the power system", "13/10", 1),
        pytest.param("indications", "1a/1a", 1),
        pytest.param("the color sensor", "18/23", 1),
        pytest.param("the ambient light sensor", "18/30", 1),
        pytest.param("the control system", "16/07", 2),
        pytest.param("IR communication", "18/27", 2),
        pytest.param("the IMU", "18/0f", 2),
    ],
)
def test_the_nodes_of_an_rvr_do_what_the_maker_says(task: str, place: str, node: int) -> None:
    """The tasks of the two nodes in "The Key Elements" of the maker's description; no command is for USB."""
    row = known(lookup(V2, *at(place), ROBOTS["rvr"]))
    assert row.nodes["rvr"] == (node,), task


def test_bolt_has_no_battery_percentage() -> None:
    assert "bolt" not in known(row_by_name(V2, "power.get_battery_percentage")).nodes


def test_rvr_plus_understands_what_rvr_does() -> None:
    assert commands_of(ROBOTS["rvr-plus"]) == commands_of(ROBOTS["rvr"])


def test_unknown_layout_and_empty_layout_differ() -> None:
    assert known(row_by_name(V2, "power.get_usb_state")).response is None
    assert known(known(row_by_name(V2, "power.wake")).response).fields == ()


@pytest.mark.parametrize(
    ("text", "name"),
    [
        pytest.param("power.get_battery_percentage", "power.get_battery_percentage", id="dotted"),
        pytest.param(
            "Power.Get-Battery-Percentage", "power.get_battery_percentage", id="hyphens and capitals"
        ),
        pytest.param("get_battery_percentage", "power.get_battery_percentage", id="bare"),
        pytest.param("echo", "api_and_shell.ping", id="alias"),
        pytest.param("power.enter_soft_sleep", "power.sleep", id="alias with its device"),
        pytest.param("get battery state", "power.get_battery_state", id="a name goes before an alias"),
        pytest.param(
            "sensor.get_encoder_counts", "sensor.get_encoder_counts", id="today's command before the old"
        ),
        pytest.param(
            "set_led_matrix_pixel", "user_io.set_compressed_frame_player_pixel", id="other source's name"
        ),
    ],
)
def test_row_by_name(text: str, name: str) -> None:
    assert known(row_by_name(V2, text)).name == name


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("", id="nothing"),
        pytest.param("power", id="device"),
        pytest.param("get_batery_percentage", id="mistyped"),
        pytest.param("set_all_leds", id="means two commands"),
        pytest.param("drive.get_battery_percentage", id="another device"),
    ],
)
def test_row_by_name_of_what_means_nothing(text: str) -> None:
    assert row_by_name(V2, text) is None


def test_every_row_is_found_by_its_name() -> None:
    assert all(row_by_name(V2, row.name) is row for row in all_rows(V2))


@pytest.mark.parametrize(
    ("text", "first"),
    [
        pytest.param("power.get_batery_percentage", "power.get_battery_percentage", id="dotted"),
        pytest.param("get-batery-percentage", "power.get_battery_percentage", id="bare"),
        pytest.param("enter_sof_sleep", "power.sleep", id="alias"),
        pytest.param("voltge", "power.get_battery_voltage", id="one word of it"),
        pytest.param("batery voltage", "power.get_battery_voltage", id="words with a blank"),
    ],
)
def test_close_names(text: str, first: str) -> None:
    names = close_names(V2, text)
    assert names[0] == first
    assert len(names) == len(set(names)) <= 3


def test_nothing_is_close_to_noise() -> None:
    assert close_names(V2, "zzzzzz") == []


def test_no_name_that_is_only_an_id_is_suggested() -> None:
    assert not [
        name
        for word in ("nothing", "unknown", "unknown_0x1f")
        for name in close_names(V2, word)
        if "0x" in name
    ]


def test_devices() -> None:
    assert device_by_name(V2, "power") == 0x13
    assert device_by_name(V2, "User-IO") == 0x1A
    assert device_by_name(V2, "pover") is None
    assert DEVICE_NAMES[V2][0x1B] == "storage"
    assert DEVICE_NAMES[V2][0x20] == "macro_system"
    assert {row.did for row in all_rows(V2)} == set(DEVICE_NAMES[V2]) - {0x1B, 0x20}
    assert BRICK_DEVICES[V2] == {0x1B, 0x1D, 0x1E, 0x1F, 0xFE}
    assert BRICK_DEVICES[Generation.V1] == {0x01}
    assert PERSIST_DEVICES[V2] == {0x20}
    assert NO_EMPTY_PROBE_DEVICES[V2] == {0x11, 0x1A}


@EACH_ROBOT
def test_robot_is_complete(robot: Robot) -> None:
    assert ROBOTS[robot.key] is robot
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", robot.key)
    assert robot.name
    assert robot.nodes[1] == ("primary" if robot.generation is V2 else "robot")
    for word in (robot.key, robot.key.upper(), robot.name, f" {robot.name.lower()} ", *robot.aliases):
        assert robot_by_word(word) is robot


@EACH_ROBOT
def test_leds_do_not_share_channels(robot: Robot) -> None:
    if robot.leds is not None:
        bits = [bit for group in robot.leds.groups for bit in group.bits]
        assert len(set(bits)) == len(bits)
        if robot.leds.mask_bytes:
            assert max(bits) < 8 * robot.leds.mask_bytes
        assert all(len(group.bits) in (1, 3) for group in robot.leds.groups)
        names = [group.name for group in robot.leds.groups]
        assert len(set(names)) == len(names)
        assert not set(names) & {alias for group in robot.leds.groups for alias in group.aliases}
        assert all(
            any(word in (group.name, *group.aliases) for group in robot.leds.groups)
            for word in ("front", "back")
        )


@EACH_V2_ROBOT
def test_leds_are_set_by_a_command_of_the_robot(robot: Robot) -> None:
    if robot.leds is not None:
        row = known(lookup(V2, robot.leds.did, robot.leds.cid, robot))
        assert robot.key in row.nodes
        assert row.request is not None
        assert row.request.fields[0].width == robot.leds.mask_bytes
        assert robot.leds.node is None or robot.leds.node in row.nodes[robot.key]
        assert (robot.leds.node is None) is not robot.addressed


@pytest.mark.parametrize(
    ("key", "facts"),
    [
        pytest.param("bolt", ("SB-", 2, True, AnswerStyle.SOURCE_ONLY, True, 2), id="BOLT"),
        pytest.param("bolt-plus", ("BP-", 1, True, AnswerStyle.SWAPPED, False, 2), id="BOLT+"),
        pytest.param("mini", ("SM-", 1, False, AnswerStyle.NONE, True, 3), id="Mini"),
        pytest.param("rvr", ("RV-", 2, True, AnswerStyle.SWAPPED, False, 11), id="RVR"),
        pytest.param("rvr-plus", ("RV-", 2, True, AnswerStyle.SWAPPED, False, 11), id="RVR+"),
        pytest.param("r2d2", ("D2-", 1, False, AnswerStyle.NONE, True, 4), id="R2-D2"),
        pytest.param("r2q5", ("Q5-", 1, False, AnswerStyle.NONE, True, 4), id="R2-Q5"),
        pytest.param("bb9e", ("GB-", 1, False, AnswerStyle.NONE, True, 3), id="BB-9E"),
        pytest.param("lmq", ("LM-", 1, False, AnswerStyle.NONE, True, 0), id="Lightning McQueen"),
        pytest.param("sphero", ("", 1, False, AnswerStyle.NONE, False, 2), id="Sphero"),
        pytest.param("sprk", ("", 1, False, AnswerStyle.NONE, False, 2), id="SPRK"),
        pytest.param("sprk-plus", ("SK-", 1, False, AnswerStyle.NONE, True, 2), id="SPRK+"),
        pytest.param("ollie", ("2B-", 1, False, AnswerStyle.NONE, True, 2), id="Ollie"),
        pytest.param("bb8", ("BB-", 1, False, AnswerStyle.NONE, True, 2), id="BB-8"),
    ],
)
def test_robot(key: str, facts: tuple[AnswerStyle | int | str, ...]) -> None:
    robot = ROBOTS[key]
    leds = len(robot.leds.groups) if robot.leds else 0
    assert facts == (
        robot.prefix,
        len(robot.nodes),
        robot.addressed,
        robot.answer_style,
        robot.handshake,
        leds,
    )


@pytest.mark.parametrize(
    ("word", "key"),
    [
        pytest.param("BOLT+", "bolt-plus", id="BOLT+"),
        pytest.param("boltplus", "bolt-plus", id="one word"),
        pytest.param("r2-d2", "r2d2", id="hyphen"),
        pytest.param("Sphero RVR+", "rvr-plus", id="name"),
        pytest.param("sphero", "sphero", id="the first one, not all of the family"),
        pytest.param("SPRK+", "sprk-plus", id="SPRK+"),
        pytest.param("bol", None, id="a part is not enough"),
        pytest.param("", None, id="nothing"),
    ],
)
def test_robot_by_word(word: str, key: str | None) -> None:
    assert robot_by_word(word) is (ROBOTS[key] if key else None)


@pytest.mark.parametrize(
    ("name", "key"),
    [
        pytest.param("SB-1234", "bolt", id="BOLT"),
        pytest.param("BP-1234", "bolt-plus", id="BOLT+"),
        pytest.param("RV-1234", "rvr", id="shared prefix: the first"),
        pytest.param("BB-1234", "bb8", id="BB-8"),
        pytest.param("2B-1234", "ollie", id="Ollie"),
        pytest.param("Sphero-RGB", None, id="no prefix"),
        pytest.param("Fridge", None, id="stranger"),
        pytest.param("", None, id="nothing"),
    ],
)
def test_robot_by_prefix(name: str, key: str | None) -> None:
    assert robot_by_prefix(name) is (ROBOTS[key] if key else None)


@pytest.mark.parametrize(
    ("name", "payload", "fields"),
    [
        pytest.param("power.get_battery_percentage", "5f", {"percentage": 95}, id="battery"),
        pytest.param("power.get_battery_voltage", "018f", {"voltage": 3.99}, id="voltage"),
        pytest.param(
            "system_info.get_main_app_version",
            "0009000101ce",
            {"major": 9, "minor": 1, "revision": 462},
            id="version",
        ),
        pytest.param(
            "sensor.get_encoder_counts", "00000001ffffffff", {"encoder_counts": [1, -1]}, id="encoders"
        ),
        pytest.param(
            "sensor.collision_detected_notify",
            "1000f000000003000100020003ff000003e8",
            {
                "acceleration_x": 1.0,
                "acceleration_y": -1.0,
                "acceleration_z": 0.0,
                "axes": ["x_axis", "y_axis"],
                "power_x": 1,
                "power_y": 2,
                "power_z": 3,
                "speed": 255,
                "time": 1000,
            },
            id="collision",
        ),
    ],
)
def test_messages_of_robots_are_decoded(name: str, payload: str, fields: dict[str, Any]) -> None:
    decoded = known(known(row_by_name(V2, name)).response).decode(bytes.fromhex(payload))
    assert decoded.fields == fields
    assert decoded.problem == ""


PERSONAL = re.compile(r"mac_|address|chassis_id|stats_id|serial|sku|^name$|^block$|application_data")
NOT_PERSONAL = {"system_info.get_processor_name"}
"""Every robot of a model has the same."""


@pytest.mark.parametrize("generation", Generation)
def test_what_tells_one_robot_from_another_is_marked(generation: Generation) -> None:
    seen = set()
    for row in (*all_rows(generation), *async_rows(generation)):
        for layout in (row.request, row.response):
            for variant in layout.variants if layout else ():
                for field in variant.fields:
                    personal = bool(PERSONAL.search(field.name)) and not field.values
                    assert field.identifying == (personal and row.name not in NOT_PERSONAL), row.name
                    seen |= {row.name} if field.identifying else set()
    assert {Generation.V1: "core.get_bluetooth_info", V2: "system_info.get_mac_address"}[generation] in seen
