"""The sources of a command, per robot and per firmware version."""

from collections import Counter

import pytest

from sphero_probe.catalogue import (
    ROBOTS,
    all_rows,
    async_rows,
    commands_of,
    lookup,
    notification_row,
    row_by_name,
)
from sphero_probe.catalogue.model import CommandRow, Kind, Robot
from sphero_probe.catalogue.provenance import (
    ASSUMED,
    ONE_UNTESTED_SOURCE,
    SIGHTINGS,
    SOURCES,
    absence_note,
    firmware_note,
    provenance_note,
    sightings_of,
    sources_for,
    switch_of,
)
from sphero_probe.protocol.packets import Generation

V1, V2 = Generation.V1, Generation.V2
BOLT_PLUS, RVR, R2D2 = ROBOTS["bolt-plus"], ROBOTS["rvr"], ROBOTS["r2d2"]
EVERY_ROW = [row for generation in Generation for row in all_rows(generation) + async_rows(generation)]
REFERENCE = {
    "system_info.get_main_app_version",
    "system_info.get_board_revision",
    "power.get_battery_voltage",
    "power.get_battery_percentage",
    "drive.set_raw_motors",
    "drive.drive_with_heading",
    "user_io.set_all_leds_with_8_bit_mask",
}
"""What the description of BOLT+ lists without saying that it is from BOLT."""


def v2(did: int, cid: int) -> CommandRow:
    row = lookup(V2, did, cid, None)
    assert row is not None
    return row


def test_every_robot_of_every_row_has_sources_of_its_own() -> None:
    for row in EVERY_ROW:
        for key in row.nodes:
            sources = sources_for(row, key)
            assert sources
            assert set(sources) <= SOURCES.keys()
            assert sources == ("assumed",) or set(sources) <= set(row.sources)
    assert {source for row in EVERY_ROW for source in row.sources} == SOURCES.keys()


def test_a_row_that_assumes_a_robot_says_so() -> None:
    for row in EVERY_ROW:
        assumed = {key for key in row.nodes if sources_for(row, key) == ("assumed",)} - {"rvr-plus", "sprk"}
        assert bool(assumed) is ("assumed" in row.sources), row.name


def test_all_93_rows_of_bolt_plus_say_from_where() -> None:
    rows = commands_of(BOLT_PLUS)
    sources = Counter(sources_for(row, "bolt-plus") for row in rows)
    assert sources == {("unsw",): 86, ("reference", "unsw"): 6, ("reference",): 1}
    assert {row.name for row in rows if "reference" in sources_for(row, "bolt-plus")} == REFERENCE
    notes = {row.name: provenance_note(row, BOLT_PLUS) for row in rows}
    assert {name for name, note in notes.items() if not note} == REFERENCE
    assert set(notes.values()) == {"", ONE_UNTESTED_SOURCE}


@pytest.mark.parametrize(
    ("robot", "pair", "note"),
    [
        pytest.param("bolt", (0x1A, 0x2F), "", id="the matrix of BOLT"),
        pytest.param("bolt-plus", (0x1A, 0x2F), ONE_UNTESTED_SOURCE, id="the matrix of BOLT+"),
        pytest.param("rvr-plus", (0x18, 0x39), ASSUMED, id="RVR+, as RVR"),
        pytest.param("lmq", (0x13, 0x0D), ASSUMED, id="Lightning McQueen, as all"),
        pytest.param("lmq", (0x17, 0x01), "", id="its own"),
        pytest.param("rvr", (0x18, 0x39), "", id="RVR"),
        pytest.param("mini", (0x18, 0x39), "", id="not among its own"),
        pytest.param(None, (0x18, 0x39), "", id="no robot"),
    ],
)
def test_provenance_note(robot: str | None, pair: tuple[int, int], note: str) -> None:
    assert provenance_note(v2(*pair), ROBOTS[robot] if robot else None) == note


def test_sightings_belong_to_rows_of_their_robots() -> None:
    for seen in SIGHTINGS:
        row = lookup(ROBOTS[seen.robot].generation, seen.did, seen.cid, ROBOTS[seen.robot])
        assert row is not None
        assert seen in sightings_of(row, ROBOTS[seen.robot])
        assert seen.node is None or seen.node in ROBOTS[seen.robot].nodes
    assert sightings_of(v2(0x18, 0x52), R2D2) == ()


@pytest.mark.parametrize(
    ("robot", "pair", "firmware", "absent", "present"),
    [
        pytest.param(
            RVR,
            (0x18, 0x52),
            "9.3.1",
            "known absent on 9.1.462 and 9.2.482 too; known to answer on 8.3.432 and 8.6.448",
            "known absent on 9.1.462 and 9.2.482",
            id="18/52 on another RVR 9 [Atriz, evidence 41 and 42]",
        ),
        pytest.param(
            RVR,
            (0x18, 0x52),
            "9.1.462",
            "known absent on 9.2.482 too; known to answer on 8.3.432 and 8.6.448",
            "known absent on 9.1.462 and 9.2.482",
            id="18/52 on the RVR of the report",
        ),
        pytest.param(
            RVR,
            (0x13, 0x27),
            "",
            "known absent on 9.1.462 and 9.2.482 too",
            "known absent on 9.1.462 and 9.2.482",
            id="13/27, firmware not told",
        ),
        pytest.param(
            R2D2, (0x17, 0x2C), "7.0.99", "known absent on 7.0.101 too", "known absent on 7.0.101", id="R2-D2"
        ),
        pytest.param(RVR, (0x18, 0x39), "9.2.482", "known to answer on 8.3.432", "", id="18/39, nodejs#6"),
        pytest.param(RVR, (0x13, 0x10), "9.2.482", "", "", id="no report"),
        pytest.param(ROBOTS["bolt"], (0x18, 0x52), "", "", "", id="another robot"),
        pytest.param(None, (0x18, 0x52), "", "", "", id="no robot"),
    ],
)
def test_firmware_note(
    robot: Robot | None, pair: tuple[int, int], firmware: str, absent: str, present: str
) -> None:
    row = v2(*pair)
    assert firmware_note(row, robot, exists=False, firmware=firmware) == absent
    assert firmware_note(row, robot, exists=True, firmware=firmware) == present


def test_absence_note() -> None:
    magnetometer, matrix = v2(0x18, 0x52), v2(0x1A, 0x2F)
    assert absence_note(magnetometer, RVR, "9.1.462").startswith("known absent on 9.2.482 too")
    assert absence_note(matrix, BOLT_PLUS) == ONE_UNTESTED_SOURCE
    both = absence_note(magnetometer, ROBOTS["rvr-plus"])
    assert both == ASSUMED
    assert absence_note(None, RVR) == absence_note(magnetometer, None) == ""


GENERATING = {
    0x01: "00:21",
    0x02: "00:40",
    0x03: "02:11",
    0x04: "02:40",
    0x07: "02:12",
    0x0B: "02:09",
}
"""Asynchronous id -> the pair that controls it, as the maker's description of V1 lists them."""


@pytest.mark.parametrize(("message", "pair"), GENERATING.items())
def test_what_switches_a_message_on_is_what_the_maker_says(message: int, pair: str) -> None:
    row = notification_row(V1, None, message, None)
    switch = row and switch_of(row)
    assert switch
    assert f"{switch.did:02x}:{switch.cid:02x}" == pair


def test_where_the_makers_description_is_contradicted_a_note_says_so() -> None:
    """The description says 02:43 for soul data; the maker's SDKs use 02:46 (RKCommandList.h, sphero.js)."""
    soul = notification_row(V1, None, 0x0D, None)
    assert soul is not None
    assert soul.enabled_by == "sphero.get_soul_block"
    assert "0x02:0x43" in soul.note
    assert "0x02:0x46" in soul.note


def test_messages_that_nothing_switches_on() -> None:
    silent = {row.cid for row in async_rows(V1) if switch_of(row) is None}
    assert silent == {0x05, 0x14, 0x20, 0x21}
    since = {row.cid: row.since for row in async_rows(V1) if row.since}
    assert since == {0x0C: "3.10"}  # the maker's description: "FW ver 3.10 and later"


@pytest.mark.parametrize(
    ("name", "switch"),
    [
        pytest.param("drive.motor_stall_notify", "drive.enable_motor_stall_notify", id="by its name"),
        pytest.param(
            "sensor.sensitivity_based_collision_detected_notify",
            "sensor.enable_sensitivity_based_collision_detection_notify",
            id="by another name",
        ),
        pytest.param("sensor.streaming_service_data_notify", "sensor.start_streaming_service", id="streams"),
        pytest.param("power.did_sleep_notify", None, id="comes by itself"),
        pytest.param("power.wake", None, id="a command"),
    ],
)
def test_switch_of(name: str, switch: str | None) -> None:
    row = row_by_name(V2, name)
    assert row is not None
    found = switch_of(row)
    assert (found and found.name) == switch


def test_every_named_switch_is_a_command_of_the_catalogue() -> None:
    named = [row for row in EVERY_ROW if row.enabled_by]
    assert len(named) > 25
    for row in named:
        switch = switch_of(row)
        assert switch is not None, row.name
        assert switch.kind is Kind.COMMAND
        assert row.kind is Kind.NOTIFICATION
