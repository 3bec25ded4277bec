"""``stream``: samples by name in every format, and nothing left switched on."""

import csv
import io
import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.support.cli import Cli, objects

AT_REST = {"accelerometer_x": (-0.1, 0.1), "accelerometer_z": (0.9, 1.1), "pitch": (-3, 3)}
"""What a robot at rest measures, with gravity along z."""


@pytest.mark.parametrize("model", ["bolt", "bolt-plus", "mini", "rvr", "r2d2", "bb8", "sprk-plus"])
def test_a_wide_table_of_samples(cli: Cli, model: str, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    device = f"fake:{model}?ledger={ledger}"
    ran = cli(
        "stream", "accelerometer", "pitch", "--rate", "50", "--count", "4", "-d", device, "--format", "csv"
    )
    assert ran.code == 0, ran.err
    head, *rows = csv.reader(io.StringIO(ran.out))
    assert head[0] == "time [s]"
    assert head[1:] == [f"accelerometer_{axis} [g]" for axis in "xyz"] + ["pitch [deg]"]
    assert len(rows) == 4
    assert [float(row[0]) for row in rows] == sorted(float(row[0]) for row in rows)
    for row in rows:
        values = dict(zip(head, row, strict=True))
        for name, (low, high) in AT_REST.items():
            unit = "deg" if name == "pitch" else "g"
            assert low <= float(values[f"{name} [{unit}]"]) <= high
    executed = objects(ledger.read_text())
    assert {entry["risk"] for entry in executed} <= {"read", "write"}
    assert switched_on(executed) == set()


def switched_on(executed: list[dict[str, object]]) -> set[object]:
    """Return what a second reading of the ledger says is still on."""
    on: set[object] = set()
    for entry in executed:
        pair, node, payload = (entry["did"], entry["cid"]), entry["node"], str(entry["payload"])
        if pair in ((0x18, 0x00), (0x18, 0x0C)):
            key = (node, pair)
            (on.add if int(payload[-8:], 16) else on.discard)(key)
        elif pair == (0x02, 0x11):
            (on.add if int(payload[8:16], 16) else on.discard)(pair)
        elif pair == (0x18, 0x3A):
            on.add(node)
        elif pair == (0x18, 0x3B):
            on.discard(node)
    return on


def test_two_nodes_give_one_sample(cli: Cli) -> None:
    ran = cli(
        *[
            "stream",
            "ambient_light",
            "yaw",
            "--rate",
            "20",
            "--count",
            "5",
            "--format",
            "jsonl",
            "-d",
            "fake:rvr",
        ]
    )
    assert ran.code == 0, ran.err
    samples = objects(ran.out)
    assert len(samples) == 5
    assert all(list(sample["values"]) == ["ambient_light", "yaw"] for sample in samples)
    assert all(None not in sample["values"].values() for sample in samples[1:])
    assert samples[0]["units"] == {"ambient_light": "lx", "yaw": "deg"}


def test_a_chart_has_a_line_for_each_value_and_needs_nothing_else(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "run.svg"
    ran = cli(
        *[
            "stream",
            "attitude",
            "accelerometer",
            "--rate",
            "100",
            "--count",
            "12",
            "-d",
            "fake:bolt",
            "--plot",
        ],
        str(file),
    )
    assert ran.code == 0, ran.err
    text = file.read_text(encoding="utf-8")
    root = ET.fromstring(text)
    lines = list(root.iter("{http://www.w3.org/2000/svg}polyline"))
    assert len(lines) == 6
    assert all(len(str(line.get("points")).split()) == 12 for line in lines)
    assert len({line.get("stroke-dasharray") for line in lines[:3]}) == 3
    assert re.findall(r"https?://[^\"]+", text) == ["http://www.w3.org/2000/svg"]


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        pytest.param(("stream", "-d", "fake:bolt"), 2, "no sensor is named", id="none"),
        pytest.param(
            ("stream", "acelerometer", "-d", "fake:bolt"), 2, "did you mean 'accelerometer'", id="near"
        ),
        pytest.param(("stream", "pitch", "--plot", "x.png", "-d", "fake:bolt"), 2, ".svg", id="picture"),
        pytest.param(("stream", "pitch", "--rate", "0", "-d", "fake:bolt"), 2, "0.1<=x<=400", id="rate"),
        pytest.param(
            ("stream", "pitch", "--count", "1", "--plot", "/no/such/x.svg", "-d", "fake:bolt"),
            10,
            "cannot write",
            id="folder",
        ),
    ],
)
def test_wrong_input(cli: Cli, words: tuple[str, ...], code: int, said: str) -> None:
    ran = cli(*words)
    assert ran.code == code
    assert said in ran.err


def test_a_dry_run_shows_what_switches_it_on_and_off(cli: Cli) -> None:
    ran = cli("stream", "pitch", "--dry-run", "--json", "-d", "fake:bolt")
    rows = json.loads(ran.out)
    assert [row["payload"] for row in rows] == ["00640000040000", "00640000000000"]
    assert all(row["withheld"] is None for row in rows)


def test_the_list_names_units(cli: Cli) -> None:
    rows = {row["name"]: row for row in json.loads(cli("stream", "--list", "--json", "-d", "fake:rvr").out)}
    assert rows["encoders"]["values"] == ["encoder_left", "encoder_right"]
    assert rows["locator"]["units"] == {"locator_x": "m", "locator_y": "m"}


def test_listen_switches_off_what_it_switched_on(cli: Cli, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    line = "sensor.set_sensor_streaming_mask interval=20 count=0 sensor_masks=0x40000"
    notify = "power.enable_battery_voltage_state_change_notify on"
    ran = cli(
        *("listen", "--send", line, "--send", notify, "--allow", "write", "--count", "2"),
        *("-d", f"fake:bolt-plus?ledger={ledger}"),
    )
    assert ran.code == 0, ran.err
    executed = [(entry["cid"], entry["payload"]) for entry in objects(ledger.read_text())][-4:]
    assert executed == [(0x00, "00140000040000"), (0x1B, "01"), (0x1B, "00"), (0x00, "00140000000000")]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "terminated"])
def test_ctrl_c_switches_off_too(number: signal.Signals, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    words = ["stream", "pitch", "--rate", "50", "--device", f"fake:bolt?ledger={ledger}"]
    with subprocess.Popen(
        [sys.executable, "-m", "sphero_probe", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        assert run.stdout is not None
        assert run.stdout.readline()
        run.send_signal(number)
        run.communicate(timeout=30)
    assert run.returncode == 128 + number
    executed = objects(ledger.read_text())
    assert switched_on(executed[:-1]) == {(2, (0x18, 0x00))}
    assert switched_on(executed) == set()
