"""``serve`` as a process of its own: what it prints, and every way in which it ends."""

import json
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Final

import pytest

from sphero_probe.cli.actions.serve import parse_endpoint
from sphero_probe.errors import UsageError
from tests.support.cli import Cli

ECHO: Final = bytes.fromhex("8d1a0110000201020301cbd8")
ECHOED: Final = bytes.fromhex("8d29011000020001020301bcd8")
COMMAND: Final = [sys.executable, "-m", "sphero_probe", "serve"]
PATIENCE: Final = 30


@contextmanager
def _served(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The process, and the line that it prints first."""
    with subprocess.Popen(
        [*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process, _first_line(process.stdout)
        finally:
            process.kill()


def _first_line(stream: IO[str] | None) -> str:
    assert stream
    return stream.readline().rstrip("\n")


def _echo(where: str) -> bytes:
    host, _, port = where.rpartition(":")
    with socket.create_connection((host, int(port)), timeout=PATIENCE) as client:
        client.sendall(ECHO)
        heard = b""
        while len(heard) < len(ECHOED):
            heard += client.recv(100)
    return heard


def test_once_it_ends_when_the_client_has_left(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    with _served(f"fake:rvr?ledger={ledger}", "--tcp", "127.0.0.1:0", "--once") as (process, where):
        assert _echo(where) == ECHOED
        assert process.wait(PATIENCE) == 0
        assert process.stdout
        assert process.stdout.read() == ""
    (line,) = ledger.read_text(encoding="utf-8").splitlines()
    assert json.loads(line) == {"node": 1, "did": 16, "cid": 0, "payload": "01020301", "risk": "read"}


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_it_cleanly(number: signal.Signals, code: int) -> None:
    with _served("fake:rvr", "--tcp", "127.0.0.1:0") as (process, where):
        assert _echo(where) == ECHOED
        process.send_signal(number)
        assert process.wait(PATIENCE) == code
        assert process.stderr
        assert "Traceback" not in process.stderr.read()


@pytest.mark.skipif(sys.platform == "win32", reason="there a process has no parent to lose")
def test_it_ends_with_the_program_that_called_it() -> None:
    caller = (
        f"import subprocess; subprocess.Popen({[*COMMAND, 'fake:rvr', '--tcp', '127.0.0.1:0']!r}); input()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", caller], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert _echo(_first_line(process.stdout)) == ECHOED
        process.kill()
        assert process.stdout
        assert process.stdout.read() == ""  # the end of the stream: the server has closed it, too


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_pseudo_terminal_is_printed_as_its_path(cli: Cli) -> None:
    with _served("fake:rvr") as (_, where):
        assert Path(where).is_char_device()
        ran = cli("send", "0x10", "0x00", "0102", "--device", f"serial:{where}", "--json")
    (finding,) = json.loads(ran.out)
    assert (ran.code, finding["payload"]) == (0, "0102")


def test_it_ends_after_a_time(cli: Cli) -> None:
    ran = cli("serve", "fake:bolt", "--tcp", "127.0.0.1:0", "--seconds", "0.05")
    assert ran.code == 0
    host, _, port = ran.out.strip().rpartition(":")
    assert host == "127.0.0.1"
    assert int(port) > 0
    assert f"'serial:socket://127.0.0.1:{port}?robot=bolt'" in ran.err


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        pytest.param(["BP-1234"], 2, "no built-in or recorded robot", id="a robot of its own"),
        pytest.param(["fake:toaster"], 2, "unknown fake robot", id="no robot"),
        pytest.param(["fake:rvr", "--pty", "--tcp", "127.0.0.1:0"], 2, "exclude each other", id="both"),
        pytest.param(["fake:rvr", "--allow-remote"], 2, "is for --tcp", id="a pseudo-terminal for others"),
        pytest.param(["fake:rvr", "--tcp", "0.0.0.0:0"], 2, "other machines", id="every interface"),
        pytest.param(["fake:rvr", "--tcp", "4242"], 2, "no host and port", id="a port alone"),
        pytest.param(
            ["fake:rvr", "--tcp", "192.0.2.1:0", "--allow-remote"], 9, "cannot listen", id="elsewhere"
        ),
        pytest.param(["fake:rvr?ledger=/nowhere/x"], 10, "/nowhere/x", id="a ledger that cannot be"),
    ],
)
def test_what_cannot_be_served(cli: Cli, arguments: list[str], code: int, words: str) -> None:
    ran = cli("serve", *arguments)
    assert (ran.code, ran.out) == (code, "")
    assert words in ran.err


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [("127.0.0.1:0", "127.0.0.1", 0), ("localhost:65535", "localhost", 65535), ("[::1]:80", "::1", 80)],
)
def test_endpoints(text: str, host: str, port: int) -> None:
    assert parse_endpoint(text, allow_remote=False) == (host, port)


@pytest.mark.parametrize("text", ["0.0.0.0:1", "[::]:1", "robot.example:1", "10.0.0.1:1"])
def test_what_other_machines_reach_takes_a_flag(text: str) -> None:
    with pytest.raises(UsageError, match="other machines"):
        parse_endpoint(text, allow_remote=False)
    assert parse_endpoint(text, allow_remote=True).port == 1


@pytest.mark.parametrize("text", ["", ":", "x", "a:", ":1", "a:65536", "a:-1", "a:1234567", "a:٣"])
def test_what_is_no_endpoint(text: str) -> None:
    with pytest.raises(UsageError, match="no host and port"):
        parse_endpoint(text, allow_remote=True)
