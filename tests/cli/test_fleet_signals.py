"""Ctrl-C during a fleet, with real processes: every robot stops, and every run can be resumed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.cli import Cli, objects

pytestmark = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
PATIENCE = 30.0
"""Seconds that a process may take at most; far more than it needs."""
DEVICES = [f"fake:bolt-plus?seed={seed}&latency=20ms" for seed in (1, 2)]
SWEEP = [
    *("fleet", "sweep", "--did", "0x13", "--format", "jsonl"),
    *(word for device in DEVICES for word in ("--device", device)),
]


def started() -> "subprocess.Popen[str]":
    """Start a fleet, and wait until each robot has findings in its journal."""
    command = [sys.executable, "-m", "sphero_probe", *SWEEP]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    runs = Path(os.environ["XDG_STATE_HOME"]) / "sphero-probe" / "runs"
    deadline = time.monotonic() + PATIENCE
    while True:
        written = [path.read_bytes().count(b'"type":"finding"') for path in runs.glob("*.jsonl")]
        if len(written) == len(DEVICES) and min(written) > 5:
            return process
        assert time.monotonic() < deadline, "no findings were written"
        assert process.poll() is None, "it ended too early"
        time.sleep(0.01)


def test_the_first_interrupt_stops_every_robot_and_resume_finishes_each(cli: Cli) -> None:
    process = started()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    stopped = [row for row in objects(out) if row["type"] == "fleet_robot"]
    assert [row["status"] for row in stopped] == ["incomplete"] * len(DEVICES)
    assert "stopping after the commands in flight" in err
    assert "repeat the command with --resume" in err
    ran = cli(*SWEEP, "--resume")
    assert ran.code == 0, ran.err
    finished = [row for row in objects(ran.out) if row["type"] == "fleet_robot"]
    assert [row["journal"] for row in finished] == [row["journal"] for row in stopped]
    for row in finished:
        lines = objects(Path(row["journal"]).read_text(encoding="utf-8"))
        found = [line["number"] for line in lines if line["type"] == "finding"]
        assert set(found) == set(range(1, 257))
    fresh = cli(*SWEEP)
    again = [row["counts"] for row in objects(fresh.out) if row["type"] == "fleet_robot"]
    assert [row["counts"] for row in finished] == again


def test_the_second_interrupt_ends_a_fleet_at_once() -> None:
    process = started()
    process.send_signal(signal.SIGINT)
    assert process.stderr
    process.stderr.readline()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE)
    assert process.returncode in (130, -signal.SIGINT)
