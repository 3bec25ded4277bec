"""The lock on a journal, and the process that holds it, from /proc/locks as in proc_locks(5)."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sphero_probe.errors import InUseError
from sphero_probe.runs.lock import holder, lock
from tests.support.cli import Cli

OpenFile = tuple[int, Path]
"""A descriptor and the file's path."""

HOLD = """
import sys
from pathlib import Path
from sphero_probe.runs.journal import Journal
with Journal.create(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def file(tmp_path: Path) -> Iterator[OpenFile]:
    path = tmp_path / "run.jsonl"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT)
    yield descriptor, path
    os.close(descriptor)


def place(descriptor: int) -> str:
    status = os.fstat(descriptor)
    return f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"


@pytest.mark.skipif(sys.platform == "win32", reason="no device numbers there")
@pytest.mark.parametrize(
    ("line", "pid"),
    [
        pytest.param("1: FLOCK  ADVISORY  WRITE 1234 {} 0 EOF", 1234, id="ours"),
        pytest.param("1: POSIX  ADVISORY  WRITE 1234 {} 0 EOF", None, id="another-kind-of-lock"),
        pytest.param("1: FLOCK  ADVISORY  WRITE 1234 00:00:1 0 EOF", None, id="another-file"),
        pytest.param("1: FLOCK  ADVISORY  WRITE 0 {} 0 EOF", None, id="another-container"),
        pytest.param("1: FLOCK  ADVISORY  WRITE -1 {} 0 EOF", None, id="no-process"),
        pytest.param("1: -> FLOCK  ADVISORY  WRITE 1234 {} 0 EOF", None, id="only-waits"),
        pytest.param("1: FLOCK", None, id="short"),
        pytest.param("\x00\xff {}", None, id="noise"),
        pytest.param("", None, id="empty"),
    ],
)
def test_the_holder_is_read_from_the_kernels_list(
    file: OpenFile, tmp_path: Path, line: str, pid: int | None
) -> None:
    table = tmp_path / "locks"
    table.write_text("9: POSIX ADVISORY READ 7 00:01:2 0 EOF\n" + line.format(place(file[0])) + "\n")
    assert holder(file[0], table) == pid


def test_where_the_system_does_not_tell_the_holder_is_unknown(file: OpenFile, tmp_path: Path) -> None:
    assert holder(file[0], tmp_path / "none") is None


def test_the_message_does_without_the_process(
    file: OpenFile, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    other = os.open(file[1], os.O_RDWR)
    try:
        lock(other, file[1])
        monkeypatch.setattr("sphero_probe.runs.lock.holder", lambda _: None)
        with pytest.raises(InUseError, match="in use by another process"):
            lock(*file)
    finally:
        os.close(other)
    lock(*file)


@pytest.mark.skipif(not Path("/proc/locks").exists(), reason="no list of locks here")
def test_another_process_is_named(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout
        assert process.stdout.readline() == "held\n"
        ran = cli("sweep", "--did", "0x13", "--device", "fake:bolt", "--journal", str(path))
        process.communicate("")
    assert ran.code == 11
    assert f"in use by process {process.pid}" in ran.err or "in use by another process" in ran.err
    assert path.exists() is False
