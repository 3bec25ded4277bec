"""Signals and a vanished parent, with real processes: every run ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.cli import objects

pytestmark = pytest.mark.skipif(os.name == "nt", reason="POSIX signals, pipes and process ids")

PATIENCE = 30.0
"""Seconds that a process may take at most; far more than it needs."""
PROBE = (sys.executable, "-m", "sphero_probe")
LONG = ("sweep", "--did", "0x10-0x1a", "--no-journal", "--device", "fake:bolt-plus?latency=30ms")
SHORT = ("sweep", "--did", "0x13", "--cid", "0-3", "--no-journal", "--device", "fake:bolt-plus")
PARENT = """
import signal, subprocess, sys
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # the tests may run under nohup
pipe = subprocess.PIPE
child = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL, stdout=open({out!r}, "w"), stderr=pipe)
print(child.pid, flush=True)
sys.stdin.read()
"""


def ends(process: "subprocess.Popen[str]") -> int:
    try:
        return process.wait(PATIENCE)
    finally:
        process.kill()


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    return not (stat.exists() and stat.read_text().rpartition(")")[2].split()[0] == "Z")


def wait_for_rows(path: Path, count: int) -> None:
    deadline = time.monotonic() + PATIENCE
    while not path.exists() or path.read_bytes().count(b"\n") < count:
        assert time.monotonic() < deadline, "no rows were written"
        time.sleep(0.01)


def test_a_fifo_without_a_reader_is_an_error_at_once(tmp_path: Path) -> None:
    fifo = tmp_path / "out"
    os.mkfifo(fifo)
    ran = subprocess.run(
        [*PROBE, *LONG, "-o", str(fifo)], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert ran.returncode == 10
    assert ran.stderr.splitlines() == [
        f"sphero-probe: cannot write {fifo}: no program reads it",
        "  start the program that reads it first",
    ]


def test_a_fifo_with_a_reader_gets_the_rows(tmp_path: Path) -> None:
    fifo = tmp_path / "out.jsonl"
    os.mkfifo(fifo)
    with subprocess.Popen(["cat", str(fifo)], stdout=subprocess.PIPE, text=True) as reader:
        held = os.open(fifo, os.O_RDWR)  # so that the reader's open has returned before the tool's begins
        ran = subprocess.run(
            [
                *PROBE,
                *["sweep", "--did", "0x13", "--cid", "0-3", "--no-journal", "-d", "fake:bolt-plus", "-o"],
                str(fifo),
            ],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        os.close(held)
        out, _ = reader.communicate(timeout=PATIENCE)
    assert ran.returncode == 0, ran.stderr
    assert sum(row["type"] == "finding" for row in objects(out)) == 4


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_two_signals_end_a_run_whose_output_nobody_takes(number: signal.Signals) -> None:
    reading, writing = os.pipe()
    process = subprocess.Popen(
        [*PROBE, *LONG, "--format", "jsonl"], stdout=writing, stderr=subprocess.DEVNULL, text=True
    )
    os.set_blocking(writing, False)
    written = 0
    while written == 0:  # the tool writes, then the rest of the pipe is filled
        written = len(os.read(reading, 1))
    try:
        while True:
            os.write(writing, bytes(4096))
    except BlockingIOError:
        os.close(writing)
    deadline = time.monotonic() + PATIENCE
    while process.poll() is None and time.monotonic() < deadline:
        process.send_signal(number)
        time.sleep(0.05)
    assert ends(process) in (-number, 128 + number)
    os.close(reading)


def test_a_run_whose_parent_died_stops(tmp_path: Path) -> None:
    """Its output is a file, so no broken pipe ends it."""
    out = tmp_path / "out.jsonl"
    command = [sys.executable, "-c", PARENT.format(out=str(out)), *PROBE, *LONG, "--format", "jsonl"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout
        child = int(parent.stdout.readline())
        wait_for_rows(out, 3)
        parent.kill()
    deadline = time.monotonic() + PATIENCE
    while is_alive(child):
        assert time.monotonic() < deadline, "the orphan goes on"
        time.sleep(0.02)
    *_, last = objects(out.read_text())
    assert last["type"] == "summary"
    assert last["complete"] is False


@pytest.mark.parametrize("kept_by", ["nohup", "setsid", "reader"])
def test_a_run_that_was_meant_to_go_on_without_its_parent_does(tmp_path: Path, kept_by: str) -> None:
    out = tmp_path / "out.jsonl"
    command = " ".join(
        [*PROBE, "sweep --did 0x13-0x16 --no-journal -d 'fake:bolt?latency=20ms' --format jsonl"]
    )
    text = {
        "nohup": f"nohup {command} </dev/null >{out} 2>/dev/null &",
        "setsid": f"setsid {command} </dev/null >{out} 2>/dev/null &",
        "reader": f"({command} </dev/null 2>/dev/null | cat >{out} &)",
    }[kept_by]
    subprocess.run(["sh", "-c", text], timeout=PATIENCE, check=True)
    deadline = time.monotonic() + PATIENCE
    while b'"summary"' not in (out.read_bytes() if out.exists() else b""):
        assert time.monotonic() < deadline, "it did not end"
        time.sleep(0.02)
    assert objects(out.read_text())[-1]["complete"] is True
