"""The first generation from the command line: the same commands, the same engine, the same reports."""

import json
from pathlib import Path

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.gatt import V1_COMMAND_CHARACTERISTIC, V1_HANDSHAKE
from sphero_probe.protocol.packets import Generation
from sphero_probe.simulator import Executed, FakeRobot, parse_settings
from tests.cli.test_cli_bluez import probe
from tests.support.cli import Cli, objects
from tests.support.fake_bluez import FakeBlueZ, Peripheral, sphero_v1

FIRST = [key for key, robot in ROBOTS.items() if robot.generation is Generation.V1]
ADDRESS = "AA:BB:CC:DD:EE:0B"


def test_the_promised_robots_are_there() -> None:
    assert set(FIRST) == {"sphero", "sprk", "sprk-plus", "ollie", "bb8"}


@pytest.mark.unmeasured
@pytest.mark.parametrize("model", FIRST)
def test_a_sweep_tells_unknown_devices_from_unknown_commands(cli: Cli, tmp_path: Path, model: str) -> None:
    ledger = tmp_path / "ledger.jsonl"
    truth = tmp_path / "truth.jsonl"
    device = f"fake:{model}?ledger={ledger}&truth={truth}"
    ran = cli("sweep", "--did", "0x00-0x03", "--device", device, "--format", "jsonl")
    assert ran.code == 0, ran.err
    findings = [row for row in objects(ran.out) if row["type"] == "finding"]
    assert len(findings) == 4 * 256
    exists = {(fact["did"], fact["cid"]) for fact in objects(truth.read_text())}
    for finding in findings:
        pair = finding["did"], finding["cid"]
        if finding["outcome"] == "skipped":
            assert finding["sent"] is None
        else:
            assert finding["outcome"] == ("exists" if pair in exists else "absent"), finding
    codes: dict[int, set[str | None]] = {finding["did"]: set() for finding in findings}
    for finding in findings:
        codes[finding["did"]].add(finding["code_name"])
    assert codes[0x01] == {None}, "the bootloader is never asked"
    assert codes[0x03] == {"unknown device id"}
    assert "unknown command id" in codes[0x00]
    named = {finding["name"] for finding in findings}
    assert {"core.ping", "sphero.get_main_led"} <= named
    executed = objects(ledger.read_text())
    assert {row["risk"] for row in executed} == {"read"}
    assert 0x01 not in {row["did"] for row in executed}


def test_led_sets_main_and_back_lamp(cli: Cli) -> None:
    ran = cli("led", "--front", "ff0000", "--back", "00f", "--device", "fake:bb8", "--json")
    main, back = json.loads(ran.out)
    assert main["sent"] == "ffff02200005ff000000d9"
    assert back["sent"] == "ffff02210102ffda"
    assert (main["number"], back["number"]) == (1, 2)


def test_send_answers_in_words_of_v1(cli: Cli) -> None:
    ping = json.loads(cli("send", "core.ping", "--device", "fake:ollie", "--json").out)[0]
    assert (ping["code_name"], ping["target"]) == ("OK", None)
    refused = cli("send", "0x02", "0x07", "00", "--device", "fake:ollie")
    assert refused.code == 7
    assert "explain --v1" in refused.err


@pytest.mark.parametrize("model", FIRST)
def test_info(cli: Cli, model: str) -> None:
    ran = cli("info", "--device", f"fake:{model}", "--json")
    facts = {fact["name"]: fact["value"] for fact in json.loads(ran.out)}
    assert facts["generation"] == "v1"
    assert facts["versions"].count(".") == 1
    assert "power_state battery_voltage" in facts


def test_decode_recognises_both_generations_in_one_input(cli: Cli) -> None:
    v1, v2, asynchronous = "ffff00015201ab", "8d0a131007cbd8", "fffe0300050001fff8ff"
    ran = cli("decode", v1, "753e", asynchronous, v2, v1, "--json")
    packets = json.loads(ran.out)
    assert [(packet["generation"], packet["kind"], packet["raw"]) for packet in packets] == [
        ("v1", "command", v1),
        ("v1", "malformed", "753e"),
        ("v1", "notification", asynchronous),
        ("v2", "command", v2),
        ("v1", "command", v1),
    ]
    assert [packet.get("name") for packet in packets][::2] == [
        "core.ping",
        "async.sensor_streaming_data_notify",
        "core.ping",
    ]
    forced = json.loads(cli("decode", "--v1", v1, "--json").out)
    assert forced[0]["did"] == 0
    assert cli("decode", "--v2", v1).code == 8


def test_explain_the_same_byte_for_both_generations(cli: Cli) -> None:
    assert "no such command id" in cli("explain", "--v1", "0x04").out
    assert "restricted" in cli("explain", "0x04").out
    assert "core.ping" in cli("explain", "--v1", "0x00:0x01").out


def test_listen_shows_a_stream_as_it_comes(cli: Cli) -> None:
    ran = cli(
        *("listen", "--send", "sphero.set_data_streaming 0028000100006000 00", "--allow", "write"),
        *("--count", "3", "--seconds", "20", "--device", "fake:bb8", "--format", "jsonl"),
    )
    assert ran.code == 0, ran.err
    packets = objects(ran.out)
    assert len(packets) == 3
    assert {packet["name"] for packet in packets} == {"async.sensor_streaming_data_notify"}
    assert all("time" in packet for packet in packets)
    assert all(set(packet["fields"]) == {"accelerometer_y", "accelerometer_z"} for packet in packets)


def test_listen_to_v2(cli: Cli) -> None:
    ran = cli(
        *("listen", "--send", "0x13 0x01", "--allow", "motion", "--count", "1", "--seconds", "20"),
        *("--device", "fake:r2d2", "--json"),
    )
    assert ran.code == 0, ran.err
    assert [packet["name"] for packet in json.loads(ran.out)] == ["power.did_sleep_notify"]


def test_listen_ends_when_the_time_is_up(cli: Cli) -> None:
    ran = cli("listen", "--seconds", "0.05", "--device", "fake:bb8", "--json")
    assert (ran.code, json.loads(ran.out)) == (0, [])


def test_listen_refuses_what_was_not_allowed(cli: Cli) -> None:
    ran = cli("listen", "--send", "sphero.roll 00000000", "--seconds", "5", "--device", "fake:bb8")
    assert ran.code == 6


def test_a_bb8_is_scanned_connected_and_swept_through_unpatched_bleak() -> None:
    executed: list[Executed] = []
    robot = FakeRobot(parse_settings("bb8"), on_execute=executed.append)
    peripheral = Peripheral(robot.name, ADDRESS, robot=robot, services=sphero_v1())
    with FakeBlueZ([peripheral]) as bluez:
        scanned = probe(bluez, "scan", "--timeout", "0.5", "--json")
        swept = probe(bluez, "sweep", "--did", "0x00", "-d", robot.name, "--format", "jsonl")
    assert [(found["model"], found["generation"]) for found in json.loads(scanned.stdout)] == [("BB-8", "v1")]
    assert swept.returncode == 0, swept.stderr
    findings = [row for row in objects(swept.stdout) if row["type"] == "finding"]
    assert len(findings) == 256
    ping = next(finding for finding in findings if finding["cid"] == 0x01)
    assert (ping["name"], ping["code_name"]) == ("core.ping", "OK")
    assert {command.risk.word for command in executed} == {"read"}
    handshake = peripheral.written[: len(V1_HANDSHAKE)]
    assert handshake == list(V1_HANDSHAKE)
    assert {uuid for uuid, _ in peripheral.written[len(V1_HANDSHAKE) :]} == {V1_COMMAND_CHARACTERISTIC}
