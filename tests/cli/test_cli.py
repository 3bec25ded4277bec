"""The command line on fake robots: what each command shows, in every format."""

import csv
import io
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.cli.values import FORMATS
from sphero_probe.protocol.packets import Generation
from tests.support.cli import Cli, objects
from tests.support.processes import rest_of
from tests.support.reports_by_hand import FINDING_KEYS

FAKE = ("--device", "fake:bolt-plus")


@pytest.mark.unmeasured
@pytest.mark.parametrize("model", ROBOTS)
@pytest.mark.parametrize("form", FORMATS)
def test_each_robot_can_be_swept_in_each_format(cli: Cli, model: str, form: str) -> None:
    ran = cli("sweep", "--did", "0x13", "--cid", "0-0x1f", "--device", f"fake:{model}", "--format", form)
    assert ran.code == 0, ran.err
    assert ran.err == ""
    if form == "jsonl":
        assert sum(row["type"] == "finding" for row in objects(ran.out)) == 32
    elif form == "json":
        assert [row["type"] for row in json.loads(ran.out)].count("finding") == 32
    elif form == "csv":
        rows = list(csv.DictReader(io.StringIO(ran.out)))
        assert [int(row["cid"], 0) for row in rows] == sorted(range(32), key=lambda cid: cid) or len(
            rows
        ) == 32
    elif form == "plain":
        assert len(ran.out.splitlines()) == 32
        assert all("\t0x13\t" in line for line in ran.out.splitlines())
    elif form == "junit":
        assert sum("0x13:" in str(case.get("name")) for case in ET.fromstring(ran.out).iter("testcase")) == 32
    elif form == "html":
        assert "0x13:0x0d" in ran.out or ROBOTS[model].generation is Generation.V1
        assert f"<title>Commands of {ROBOTS[model].name}" in ran.out
    else:
        assert "0x13:0x0d" in ran.out or ROBOTS[model].generation is Generation.V1
        assert "Not shown: " in ran.out
        assert ROBOTS[model].name in ran.out


def test_a_sweep_gives_one_finding_per_cid_and_executes_only_reads(cli: Cli, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    ran = cli("sweep", "--did", "0x13", "--device", f"fake:bolt-plus?ledger={ledger}", "--format", "jsonl")
    rows = objects(ran.out)
    assert rows[0]["type"] == "run"
    assert rows[0]["schema_version"] == 2
    assert all("schema_version" not in row for row in rows[1:])
    findings = [row for row in rows if row["type"] == "finding"]
    assert sorted(row["cid"] for row in findings) == list(range(256))
    assert all(list(row) == ["type", *FINDING_KEYS] for row in findings)
    battery = next(row for row in findings if row["cid"] == 0x10)
    assert battery["name"] == "power.get_battery_percentage"
    assert battery["outcome"] == "exists"
    assert 0 <= battery["fields"]["percentage"] <= 100
    assert battery["units"] == {"percentage": "%"}
    assert bytes.fromhex(battery["received"])[0] == 0x8D
    assert rows[-1]["type"] == "summary"
    assert sum(rows[-1]["counts"].values()) == 256
    assert {row["risk"] for row in objects(ledger.read_text())} == {"read"}


def test_led_sends_the_packet_of_the_reference(cli: Cli) -> None:
    front = json.loads(cli("led", "--front", "ff0000", *FAKE, "--json").out)[0]
    assert front["sent"] == "8d3a11011a1c0007ff000077d8"
    both = json.loads(cli("led", "--front", "ff0000", "--back", "f00", *FAKE, "--json").out)[0]
    assert both["sent"] == "8d3a11011a1c003fff0000ff000040d8"
    assert both["code_name"] == "success"
    off = json.loads(cli("led", "--off", "--led", "back=00f", *FAKE, "--json").out)[0]
    assert off["sent"][14:-4] == "3f0000000000ff"


@pytest.mark.parametrize("model", [key for key, robot in ROBOTS.items() if robot.leds])
def test_every_lamp_of_every_robot_can_be_set(cli: Cli, model: str) -> None:
    table = ROBOTS[model].leds
    assert table
    for group in table.groups:
        for name in (group.name, *group.aliases):
            ran = cli("led", "--led", f"{name}=010203", "--device", f"fake:{model}")
            assert ran.code == 0, (name, ran.err)


def test_send_by_name_and_by_number(cli: Cli) -> None:
    by_name = json.loads(cli("send", "power.get_battery_percentage", *FAKE, "--json").out)[0]
    by_number = json.loads(cli("send", "0x13", "16", *FAKE, "--json").out)[0]
    by_pair = json.loads(cli("send", "0x13:0x10", *FAKE, "--json").out)[0]
    for finding in (by_name, by_number, by_pair):
        assert list(finding)[:2] == ["type", "schema_version"]
        assert (finding["did"], finding["cid"], finding["code"]) == (0x13, 0x10, 0)
    assert by_name["fields"] == by_number["fields"] == by_pair["fields"]


def test_send_with_arguments_reaches_the_node_that_serves_it(cli: Cli, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    ran = cli(
        *("send", "drive.set_raw_motors", "00 00 00 00", "--allow", "motion"),
        *("--device", f"fake:bolt?ledger={ledger}", "--json"),
    )
    assert ran.code == 0, ran.err
    assert json.loads(ran.out)[0]["target"] == 0x12
    executed = [row for row in objects(ledger.read_text()) if row["did"] == 0x16]
    assert [(row["node"], row["payload"]) for row in executed] == [(2, "00000000")] * 2  # and the final stop


def test_send_to_a_node_by_name(cli: Cli) -> None:
    ran = cli("send", "0x11", "0x00", "--target", "secondary", "--device", "fake:rvr", "--json")
    assert json.loads(ran.out)[0]["target"] == 0x12
    ran = cli("send", "0x11", "0x00", "--target", "none", "--device", "fake:rvr", "--json")
    assert json.loads(ran.out)[0]["target"] is None


SILENT = [
    pytest.param("0x13:0x03", "0x13 0x03", 7, "in 3 attempts; the robot answers other commands", id="woken"),
    pytest.param("0x16:0x01", "0x16 0x01 00000000", 7, "in 1 attempt; the robot answers", id="echo-answered"),
    pytest.param("0x13:0x03,0x13:0x0d", "0x13 0x03", 7, "in 3 attempts; the robot answers", id="no-wake"),
    pytest.param("0x13:0x03,0x13:0x0d,0x10:0x00", "0x13 0x03", 4, "connected and answers nothing", id="mute"),
    pytest.param("0x16:0x01,0x10:0x00", "0x16 0x01 00000000", 4, "answers nothing", id="mute-motion"),
]
"""What the robot never answers, the command, the exit code and what is said."""


@pytest.mark.parametrize(("silent", "words", "code", "said"), SILENT)
def test_silence_of_one_command_is_not_silence_of_the_robot(
    cli: Cli, silent: str, words: str, code: int, said: str
) -> None:
    device = ("--device", f"fake:bolt?silent={silent}", "--timeout", "10ms", "--allow", "motion")
    ran = cli("send", *words.split(), *device, "--json")
    assert ran.code == code, ran.err
    assert json.loads(ran.out)[0]["outcome"] == "silent"
    assert said in ran.err
    assert f"no answer to {words[:4]}:{words[5:9]} " in ran.err


def test_listen_tells_silence_apart_in_the_same_way(cli: Cli) -> None:
    ran = cli("listen", "--send", "0x13 0x03", "--seconds", "5", "--device", "fake:bolt?silent=0x13:0x03")
    assert ran.code == 7, ran.err


def test_silence_to_a_node_that_does_not_exist_is_no_mute_robot(cli: Cli) -> None:
    ran = cli(
        "send", "0x13", "0x03", "--target", "0x1e", "--timeout", "10ms", "--device", "fake:bolt", "--json"
    )
    assert ran.code == 7, ran.err


def test_a_command_that_stayed_silent_ends_its_journal(cli: Cli) -> None:
    cli("send", "0x13", "0x03", "--timeout", "10ms", "--device", "fake:bolt?silent=0x13:0x03")
    (run,) = json.loads(cli("runs", "--json").out)
    assert run["complete"] is True


def test_dry_run_shows_bytes_and_touches_nothing(cli: Cli, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    device = ("--device", f"fake:bolt-plus?ledger={ledger}")
    sweep = cli("sweep", "--did", "0x13", "--cid", "0,1,0x30", *device, "--dry-run", "--json")
    assert "nothing is sent" in sweep.err
    withheld, documented, probe = json.loads(sweep.out)
    assert withheld["risk"] == "brick"
    assert "--allow brick" in withheld["withheld"]
    assert "documented, not sent at a wrong length (--allow motion)" in documented["withheld"]
    assert (probe["risk"], probe["withheld"]) == ("probe", None)
    led = cli("led", "--front", "ff0000", *device, "--dry-run", "--json")
    assert json.loads(led.out)[0]["sent"] == "8d3a11011a1c0007ff000077d8"
    send = cli("send", "power.sleep", *device, "--dry-run", "--json")
    assert json.loads(send.out)[0]["risk"] == "motion"
    assert not ledger.exists()


def test_info_tells_firmware_per_node(cli: Cli) -> None:
    facts = json.loads(cli("info", "--device", "fake:rvr", "--json").out)
    versions = {fact["node"]: fact["value"] for fact in facts if fact["name"] == "main_app_version"}
    assert set(versions) == {"primary", "secondary"}
    assert all(version.count(".") == 2 for version in versions.values())


@pytest.mark.parametrize("model", ROBOTS)
def test_info_on_each_robot(cli: Cli, model: str) -> None:
    ran = cli("info", "--device", f"fake:{model}")
    assert ran.code == 0
    assert ROBOTS[model].name in ran.out
    assert "battery" in ran.out


def test_explain_a_code_and_a_command(cli: Cli) -> None:
    assert "bad data length" in cli("explain", "0x05").out
    assert "unlisted" in cli("explain", "0xee").out
    assert "power.get_battery_percentage" in cli("explain", "0x13:0x10").out
    assert "power.get_battery_percentage" in cli("explain", "get_battery_percentage").out


def test_catalog_filters(cli: Cli) -> None:
    everything = json.loads(cli("catalog", "--json").out)
    assert len({(row["did"], row["cid"]) for row in everything}) >= 391
    mine = json.loads(cli("catalog", "battery", "--robot", "mini", "--json").out)
    assert mine
    assert all("mini" in row["robots"] and "battery" in row["name"] for row in mine)
    nothing = cli("catalog", "no-such-thing", "--json")
    assert (nothing.code, json.loads(nothing.out)) == (0, [])


def test_decode_from_arguments_files_and_standard_input(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = "8d3911011a1c00007ed8"
    spaced = " ".join(frame[i : i + 2] for i in range(0, len(frame), 2))
    binary = tmp_path / "frames.bin"
    binary.write_bytes(bytes.fromhex(frame) * 2)
    text = tmp_path / "frames.txt"
    text.write_text(f"{spaced}\n{frame}\n")
    one = json.loads(cli("decode", frame, "--json").out)
    assert one == json.loads(cli("decode", *spaced.split(), "--json").out)
    assert (one[0]["kind"], one[0]["code_name"], one[0]["raw"]) == ("response", "success", frame)
    assert [packet["raw"] for packet in json.loads(cli("decode", str(binary), "--json").out)] == [frame] * 2
    assert [packet["raw"] for packet in json.loads(cli("decode", str(text), "--json").out)] == [frame] * 2
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(bytes.fromhex(frame) + b"\x8d\x01")))
    packets = json.loads(cli("decode", "-", "--json").out)
    assert [packet["kind"] for packet in packets] == ["response", "malformed"]
    assert packets[1]["reason"] == "the line went quiet inside a frame"


def test_plan_list_show_and_check(cli: Cli, tmp_path: Path) -> None:
    names = {plan["name"] for plan in json.loads(cli("plan", "list", "--json").out)}
    assert {"hello", "bolt_plus", "which_devices"} <= names
    shown = json.loads(cli("plan", "show", "hello", "--json").out)
    assert [probe["did"] for probe in shown] == [0x13, 0x10, 0x11, 0x13]
    assert "hello: ok, 4 probes" in cli("plan", "check", "hello").out
    broken = tmp_path / "broken.py"
    broken.write_text("PLAN = None\n")
    other = tmp_path / "other.py"
    other.write_text("import nothing_of_that_name\n")
    assert cli("plan", "check", str(broken)).code == 8
    both = cli("plan", "check", str(broken), "hello", str(other))
    assert both.code == 8
    assert "hello: ok" in both.out
    assert "broken.py" in both.err
    assert "other.py:1" in both.err


def test_output_file_takes_its_format_from_its_name(cli: Cli, tmp_path: Path) -> None:
    for suffix, start in ((".json", "["), (".jsonl", "{"), (".csv", "generation,did,"), (".txt", "")):
        path = tmp_path / f"out{suffix}"
        assert cli("catalog", "battery", "-o", str(path)).out == ""
        assert path.read_text().startswith(start)


def test_colour_follows_option_and_environment(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def coloured(*arguments: str) -> bool:
        return "\x1b[" in cli("explain", "power.sleep", "--format", "table", *arguments).out

    assert not coloured()
    assert coloured("--color", "always")
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert coloured()
    assert not coloured("--color", "never")
    monkeypatch.setenv("NO_COLOR", "1")
    assert coloured()
    monkeypatch.delenv("FORCE_COLOR")
    assert not coloured()


def test_the_device_may_stand_in_the_environment(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPHERO_PROBE_DEVICE", "fake:mini")
    assert "Sphero Mini" in cli("info").out


@pytest.mark.unmeasured
def test_hidden_commands_lead_the_table(cli: Cli) -> None:
    ran = cli("sweep", "--did", "0x10-0x1a", "--device", "fake:bolt?hidden=8&seed=1", "--format", "table")
    assert "not in any catalogue" in ran.out
    assert ran.out.index("not in any catalogue") < ran.out.index("get_battery_voltage")


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["ctrl-c", "terminate"]
)
def test_a_signal_ends_a_sweep_cleanly(number: signal.Signals, code: int) -> None:
    words = ["sweep", "--did", "0x13", "--device", "fake:bolt?latency=30ms", "--format", "jsonl"]
    with subprocess.Popen(
        [sys.executable, "-m", "sphero_probe", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as ran:
        assert ran.stdout
        seen = [ran.stdout.readline() for _ in range(5)]
        ran.send_signal(number)
        out, err = rest_of(ran)
    rows = objects("".join(seen) + out)
    assert ran.returncode == code
    assert "stopping" in err
    assert "Traceback" not in err
    assert rows[-1]["type"] == "summary"
    assert rows[-1]["complete"] is False
    assert sum(row["type"] == "finding" for row in rows) < 256


def test_python_dash_m_is_the_same(tmp_path: Path) -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "sphero_probe", "--version"],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    assert ran.stdout.startswith("sphero-probe ")
    assert Path(sys.executable).exists()
