"""What the catalogue knows, as the command line shows it: bytes in, names, LEDs and sources out."""

import json
import struct

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.protocol.packets import Command, Notification, Response
from sphero_probe.protocol.v2 import V2
from sphero_probe.simulator import FakeRobot, parse_settings
from tests.support.cli import Cli

LAMPS = "8d3a11011a1c003fff0000ff000040d8"
"""The worked example of the description of BOLT+: front and back red."""


def rows(cli: Cli, *arguments: str) -> list[dict[str, object]]:
    ran = cli(*arguments, "--format", "jsonl")
    assert ran.code == 0, ran.err
    return [json.loads(line) for line in ran.out.splitlines()]


def test_decode_names_the_lamps_of_the_robot(cli: Cli) -> None:
    (row,) = rows(cli, "decode", LAMPS, "--robot", "bolt-plus")
    assert row["leds"] == {"front": "ff0000", "back": "ff0000"}
    assert row["fields"] == {"mask": 0x3F, "values": "ff0000ff0000"}
    assert "front ff0000, back ff0000" in cli("decode", LAMPS, "--robot", "BOLT+", "--format", "table").out
    (unknown,) = rows(cli, "decode", LAMPS)
    assert "leds" not in unknown
    ran = cli("decode", LAMPS, "--robot", "bolt-plsu")
    assert ran.code == 2
    assert "bolt-plus" in ran.err


def test_decode_names_v1_responses_after_their_commands(cli: Cli) -> None:
    command, response = rows(cli, "decode", "ffff002052018c ffff00520901 0202ef000a0100a5")
    assert command["name"] == response["name"] == "core.get_power_state"
    assert (response["did"], response["cid"]) == (0x00, 0x20)
    fields = response["fields"]
    assert isinstance(fields, dict)
    assert (fields["state"], fields["battery_voltage"]) == ("ok", 7.51)


def test_decode_tells_a_damaged_v1_frame_by_its_checksum(cli: Cli) -> None:
    damaged, sound = rows(cli, "decode", "ffff000001ffffff000001fe")
    assert (damaged["raw"], damaged["reason"]) == ("ffff000001ff", "checksum 0xff, expected 0xfe")
    assert (sound["kind"], sound["code"]) == ("response", 0)


def test_decode_takes_a_wake_of_the_makers_sdk_for_a_command(cli: Cli) -> None:
    """Flags 0x18, SEQ 0xFF, as that SDK writes it."""
    (row,) = rows(cli, "decode", "8d1801130dffc7d8")
    assert (row["kind"], row["name"], row["seq"]) == ("command", "power.wake", 0xFF)


def test_decode_reads_a_collision_without_power_z(cli: Cli) -> None:
    (row,) = rows(cli, "decode", "8d28021812ff006afc3e00000200160022640001e24047d8")
    fields = row["fields"]
    assert isinstance(fields, dict)
    assert (fields["power_x"], fields["power_y"], fields["speed"], fields["time"]) == (22, 34, 100, 123456)
    assert "power_z" not in fields


@pytest.mark.parametrize("key", sorted(ROBOTS))
def test_led_lists_the_lamps_of_a_robot(cli: Cli, key: str) -> None:
    listed = rows(cli, "led", "--list", "--device", f"fake:{key}")
    table = ROBOTS[key].leds
    assert [row["name"] for row in listed] == [group.name for group in (table.groups if table else ())]
    assert {row["robot"] for row in listed} <= {key}
    assert [row["type"] for row in listed] == ["led"] * len(listed)


def test_led_lists_the_lamps_of_every_robot_where_none_is_named(cli: Cli) -> None:
    assert {row["robot"] for row in rows(cli, "led", "--list")} == {
        key for key, robot in ROBOTS.items() if robot.leds
    }
    table = cli("led", "--list", "--device", "fake:bolt-plus", "--format", "table").out
    assert "red 0, green 1, blue 2" in table


def test_explain_tells_firmware_and_sources(cli: Cli) -> None:
    (row,) = rows(cli, "explain", "0x18:0x52")
    seen = row["firmware"]
    assert isinstance(seen, list)
    assert {(one["firmware"], one["exists"]) for one in seen} == {
        ("9.1.462", False),
        ("9.2.482", False),
        ("8.3.432", True),
        ("8.6.448", True),
    }
    provenance = row["provenance"]
    assert isinstance(provenance, dict)
    assert provenance["rvr"] == ["sdk"]
    text = cli("explain", "0x18:0x52", "--format", "table").out
    assert "rvr 9.2.482: no such command (Bura-hub/Atriz_migracion_ros2, evidence 41)" in " ".join(
        text.split()
    )


def test_explain_and_catalog_say_where_one_untested_source_is_all_there_is(cli: Cli) -> None:
    words = "bolt-plus: reported by one untested source"
    assert words in " ".join(cli("explain", "0x1a:0x2f", "--format", "table").out.split())
    assert words not in cli("explain", "0x1a:0x1c", "--format", "table").out
    listed = rows(cli, "catalog", "--robot", "bolt-plus")
    assert len(listed) == 93
    untested = [row for row in listed if row["provenance"]["bolt-plus"] == ["unsw"]]  # type: ignore[index]
    assert len(untested) == 86
    table = cli("catalog", "one_color", "--robot", "bolt-plus", "--format", "table").out
    assert "bolt-plus reported by one" in table


def test_explain_tells_what_switches_a_message_on_and_since_when(cli: Cli) -> None:
    by_name = {row["name"]: row for row in rows(cli, "catalog", "async.", "--v1")}
    gyro = by_name["async.gyro_max_notify"]
    assert (gyro["enabled_by"], gyro["since"]) == ("sphero.set_persistent_options", "3.10")
    assert by_name["async.soul_block_notify"]["enabled_by"] == "sphero.get_soul_block"
    (stall,) = rows(cli, "explain", "drive.motor_stall_notify")
    assert stall["enabled_by"] == "drive.enable_motor_stall_notify"


@pytest.mark.parametrize(
    ("subject", "name", "risk"),
    [
        pytest.param("0x02:0x73", "sphero.reset_soul_block", "brick", id="RKCommandList.h"),
        pytest.param("0x01:0x06", "bootloader.erase_user_config", "brick", id="bootloader"),
        pytest.param("0x02:0x75", "sphero.read_odometer", "persist", id="a read by its name"),
    ],
)
def test_explain_knows_what_only_a_header_names(cli: Cli, subject: str, name: str, risk: str) -> None:
    (row,) = rows(cli, "explain", "--v1", subject)
    assert (row["name"], row["risk"], row["sources"]) == (name, risk, ["iossdk"])


RVR_STREAM = "8d1802183902010001028ed8 8d2802183dff018655d300814c13008794eb00ecd8"
"""A configuration and a delivery, as the maker's Python SDK logged them."""


def test_decode_reads_a_streaming_service_by_what_was_configured_in_the_same_input(cli: Cli) -> None:
    configured, delivered = rows(cli, "decode", RVR_STREAM)
    assert configured["name"] == "sensor.configure_streaming_service"
    fields = delivered["fields"]
    assert isinstance(fields, dict)
    assert {name: round(fields[name], 3) for name in ("pitch", "roll", "yaw")} == {
        "pitch": 8.909,
        "roll": 0.912,
        "yaw": 10.662,
    }
    (alone,) = rows(cli, "decode", RVR_STREAM.split()[1])
    assert alone["fields"] == {"token": 1, "sensor_data": "8655d300814c13008794eb00"}


def test_decode_names_no_number_behind_a_bit_that_this_robot_does_not_have(cli: Cli) -> None:
    """The mask of the maker's app for Mini, bits 15-10: the gyroscope on a Mini, unknown on a BOLT."""
    mask = V2.encode_command(Command(0x18, 0x00, bytes.fromhex("0096 00 0000fc00")), 1)
    taken = V2.encode_response(Response(1, 0, b"", 0x18, 0x00))
    numbers = struct.pack(">6f", 0.25, 0.5, 1.0, -2.5, 3.0, 4.5)
    streamed = V2.encode_notification(Notification(0x18, 0x02, numbers))
    capture = (mask + taken + streamed).hex()
    *_, mini = rows(cli, "decode", capture, "--robot", "mini")
    *_, bolt = rows(cli, "decode", capture, "--robot", "bolt")
    assert isinstance(mini["fields"], dict)
    assert isinstance(bolt["fields"], dict)
    accelerometer = {"accelerometer_x": 0.25, "accelerometer_y": 0.5, "accelerometer_z": 1.0}
    assert mini["fields"] == accelerometer | {"gyroscope_x": -2.5, "gyroscope_y": 3.0, "gyroscope_z": 4.5}
    assert bolt["fields"] == accelerometer | {"values": [-2.5, 3.0, 4.5]}
    assert bolt["note"] == "unknown sensor bit 0x00001000, 0x00000800, 0x00000400"
    assert "note" not in mini


def test_listen_reads_the_streaming_services_of_rvr(cli: Cli) -> None:
    sends = ("--send", "0x18 0x39 01000300", "--send", "0x18 0x3a 0032")
    heard = rows(cli, "listen", *sends, "--allow", "write", "--count", "2", "--device", "fake:rvr?seed=3")
    deliveries = [row["fields"] for row in heard if row["name"] == "sensor.streaming_service_data_notify"]
    assert deliveries
    sensors = FakeRobot(parse_settings("rvr?seed=3")).sensors
    for fields in deliveries:
        assert isinstance(fields, dict)
        assert fields["token"] == 1
        assert all(fields[name] == sensors[name] for name in ("red", "green", "blue", "color_index"))
        assert fields["color_confidence"] == pytest.approx(sensors["color_confidence"], abs=1 / 255)


def test_a_sweep_says_beside_an_absent_command_what_is_known_of_it(cli: Cli) -> None:
    device = ("--device", "fake:bolt-plus", "--format", "jsonl")
    ran = cli("sweep", "--did", "0x1a", "--cid", "0x2f,0x1c,0x1b", *device)
    findings = {row["cid"]: row for row in map(json.loads, ran.out.splitlines()) if row["type"] == "finding"}
    assert (findings[0x2F]["outcome"], findings[0x2F]["note"]) == (
        "absent",
        "reported by one untested source",
    )
    assert findings[0x1C]["outcome"] == "exists"
    assert "untested" not in findings[0x1C]["note"]
    assert "untested" not in findings[0x1B]["note"]
