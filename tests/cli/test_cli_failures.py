"""Bad input of each kind: one clear line (and a hint), its exit code, never a traceback."""

import subprocess
import sys
from pathlib import Path

import pytest

from sphero_probe.cli import invoke
from tests.support.cli import Cli

FAKE = ("--device", "fake:bolt-plus")
PROBE = (sys.executable, "-m", "sphero_probe")

USAGE = 2


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        pytest.param(
            ("sweep", "--did", "pwoer", *FAKE), USAGE, "did you mean 'power'", id="unknown-did-name"
        ),
        pytest.param(("sweep", "--did", "0x1a-0x10", *FAKE), USAGE, "runs backwards", id="backwards-range"),
        pytest.param(("sweep", "--did", "0x113", *FAKE), USAGE, "larger than 0xff", id="did-too-large"),
        pytest.param(("sweep", "--did", "0x13,,0x14", *FAKE), USAGE, "no device named ''", id="empty-part"),
        pytest.param(("sweep", "--did", "-1", *FAKE), USAGE, "", id="negative"),
        pytest.param(("sweep", *FAKE), USAGE, "nothing to sweep", id="nothing-to-sweep"),
        pytest.param(
            ("sweep", "--plan", "hello", "--did", "0x13", *FAKE),
            USAGE,
            "--plan cannot be combined with --did",
            id="plan-and-did",
        ),
        pytest.param(
            ("sweep", "--did", "0x13", "--payload", "012", *FAKE), USAGE, "odd number", id="odd-payload"
        ),
        pytest.param(
            ("sweep", "--did", "0x13", "--target", "third", *FAKE), USAGE, "no node named", id="node"
        ),
        pytest.param(("sweep", "--did", "0x13", "--format", "xml", *FAKE), USAGE, "xml", id="format"),
        pytest.param(("sweep", "--did", "0x13", "--allow", "all", *FAKE), USAGE, "all", id="allow-all"),
        pytest.param(("send", "0x13", "0x10", "abc", *FAKE), USAGE, "odd number of hex digits", id="odd-hex"),
        pytest.param(("send", "0x13", "0x10", "zz", *FAKE), USAGE, "takes no arguments", id="not-hex"),
        pytest.param(("send", "0x13", *FAKE), USAGE, "a DID alone", id="did-alone"),
        pytest.param(
            ("send", "power.get_batery_percentage", *FAKE),
            USAGE,
            "power.get_battery_percentage",
            id="near-name",
        ),
        pytest.param(("send", "drive.set_raw_motors", *FAKE), USAGE, "takes arguments", id="needs-arguments"),
        pytest.param(("led", "--front", "ff000", *FAKE), USAGE, "not a colour", id="colour-of-5-digits"),
        pytest.param(("led", *FAKE), USAGE, "no LED is named", id="no-led"),
        pytest.param(("led", "--led", "front", *FAKE), USAGE, "NAME=COLOUR", id="lamp-without-colour"),
        pytest.param(("led", "--led", "frnt=f00", *FAKE), USAGE, "did you mean 'front'", id="unknown-lamp"),
        pytest.param(("led", "--front", "f00", "--device", "fake:lmq"), USAGE, "no LEDs are known", id="lmq"),
        pytest.param(("info", "--device", "fake:blot"), USAGE, "bolt", id="unknown-model"),
        pytest.param(("info", "--device", "fake:bolt?sed=1"), USAGE, "seed", id="unknown-key"),
        pytest.param(("info", "--device", "fake:bolt?latency=15"), USAGE, "15", id="time-without-unit"),
        pytest.param(("info", "--device", "fake:"), USAGE, "names no robot", id="no-model"),
        pytest.param(("info", "--device", "fak:bolt"), USAGE, "did you mean 'fake:'", id="unknown-scheme"),
        pytest.param(("explain", "0x13:0xee"), USAGE, "not in the catalogue", id="unknown-pair"),
        pytest.param(("explain", "0x1ff"), USAGE, "larger than 0xff", id="code-too-large"),
        pytest.param(("explain", "power.slep"), USAGE, "power.sleep", id="near-command"),
        pytest.param(("catalog", "--robot", "bolz"), USAGE, "did you mean 'bolt'", id="unknown-robot"),
        pytest.param(("decode", "8d0"), USAGE, "odd number", id="odd-packet"),
        pytest.param(("swep",), USAGE, "did you mean 'sweep'", id="unknown-command"),
        pytest.param(("sweep", "--dit", "1"), USAGE, "--did", id="unknown-option"),
        pytest.param(("decode", "no/such.bin"), 8, "No such file", id="missing-file"),
        pytest.param(("decode", "."), 8, "directory", id="directory"),
        pytest.param(("decode", "d8d8"), 8, "no packet", id="no-packet"),
        pytest.param(("sweep", "--plan", "no_such", *FAKE), 8, "no such plan", id="missing-plan"),
        pytest.param(("plan", "show", "no_such.py"), 8, "no such plan", id="missing-plan-file"),
        pytest.param(("send", "0x13", "0x00", "00", *FAKE), 6, "--allow brick", id="refused"),
        pytest.param(("send", "power.sleep", *FAKE), 6, "--allow motion", id="refused-motion"),
        pytest.param(
            ("send", "0x13", "0x00", "00", "--allow", "brick", "--confirm", "BP-0000", *FAKE),
            6,
            "--confirm",
            id="wrong-confirm",
        ),
        pytest.param(
            ("sweep", "--did", "0x13", "--allow", "brick", "--confirm", "BP-0000", *FAKE),
            6,
            "--confirm BP-0000 names another robot",
            id="wrong-confirm-of-a-sweep",
        ),
        pytest.param(
            ("sweep", "--did", "0x13", "--allow", "brick", "--device", "ble:nowhere"),
            6,
            "confirm it with the robot's name",
            id="no-confirm-is-said-before-connecting",
        ),
        pytest.param(
            ("led", "--front", "f00", "--confirm", "BP-0000", *FAKE),
            USAGE,
            "--confirm belongs to --allow brick",
            id="confirm-for-nothing",
        ),
        pytest.param(("sweep", "0x13", *FAKE), USAGE, "write --did 0x13", id="did-without-option"),
        pytest.param(
            ("send", "0x13", "0x99", *FAKE), 6, "without payload, which may run it", id="unknown-empty"
        ),
        pytest.param(
            ("send", "0x10", "0x09", "05", "--device", "fake:rvr"),
            7,
            "0x05 bad data length",
            id="robot-refuses",
        ),
        pytest.param(("catalog", "-o", "/no/such/folder/x"), 10, "cannot write", id="output-folder"),
        pytest.param(
            ("info", "--device", "fake:bolt?ledger=/no/such/folder/x"), 10, "cannot write", id="ledger-folder"
        ),
    ],
)
def test_bad_input(cli: Cli, arguments: tuple[str, ...], code: int, said: str) -> None:
    ran = cli(*arguments)
    assert ran.code == code
    assert said in ran.err
    lines = ran.err.splitlines()
    assert 1 <= len(lines) <= 2
    assert lines[0].startswith("sphero-probe: ")
    assert "Traceback" not in ran.err


@pytest.mark.parametrize(
    ("source", "line", "said"),
    [
        pytest.param("x = 1\ny = 1 / 0\n", 2, "ZeroDivisionError", id="raises"),
        pytest.param("PLAN = (\n", 1, "was never closed", id="syntax"),
        pytest.param("x = 1\n\nwhile True:\n    pass\n", None, "still running", id="endless"),
        pytest.param("x = 1\n", None, "defines no PLAN", id="no-plan"),
        pytest.param("PLAN = 7\n", None, "PLAN is 7", id="not-a-plan"),
        pytest.param("import sys\nsys.exit(3)\n", 2, "SystemExit", id="exits"),
        pytest.param(b"\x00\xff\xfe\x8d".decode("latin1"), None, "plan.py", id="binary"),
    ],
)
def test_broken_plan(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, line: int | None, said: str
) -> None:
    monkeypatch.setattr("sphero_probe.probing.plans.loader.MAX_SECONDS", 0.2)
    path = tmp_path / "plan.py"
    path.write_text(source, encoding="utf-8")
    ran = cli("sweep", "--plan", str(path), *FAKE)
    assert ran.code == 8
    assert said in ran.err
    assert str(path) in ran.err
    if line:
        assert f"{path}:{line}: " in ran.err
    assert "Traceback" not in ran.err


def test_binary_rubbish_is_shown_as_evidence_and_ends_with_8(cli: Cli, tmp_path: Path) -> None:
    noise = tmp_path / "rubbish.bin"
    noise.write_bytes(bytes(range(256)) * 4)
    ran = cli("decode", str(noise), "--format", "jsonl")
    assert ran.code == 8
    assert "no packet in 1024 bytes" in ran.err
    assert '"kind":"malformed"' in ran.out.replace(" ", "")


def test_debug_shows_the_traceback(cli: Cli) -> None:
    ran = cli("info", "--device", "fake:blot", "--debug")
    assert ran.code == USAGE
    assert "Traceback" in ran.err


def test_a_bug_is_one_line_and_a_file(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> int:
        raise AssertionError("surprise")

    monkeypatch.setattr(invoke, "_run", broken)
    ran = cli("info")
    assert ran.code == 70
    assert "a bug in sphero-probe (AssertionError: surprise)" in ran.err
    assert "Traceback" not in ran.err
    report = Path(ran.err.split("the traceback is in ")[1].splitlines()[0])
    assert "surprise" in report.read_text(encoding="utf-8")
    report.unlink()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_full_disk() -> None:
    with Path("/dev/full").open("w") as full:
        ran = subprocess.run([*PROBE, "catalog"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ran.returncode == 10
    assert ran.stderr.splitlines()[0] == "sphero-probe: cannot write the output: No space left on device"
    assert "Traceback" not in ran.stderr


@pytest.mark.parametrize(
    "arguments", [("catalog",), ("sweep", "--did", "0x11-0x13", "--format", "jsonl", *FAKE)], ids="-".join
)
def test_closed_pipe_ends_quietly(arguments: tuple[str, ...]) -> None:
    ran = subprocess.Popen([*PROBE, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert ran.stdout
    assert ran.stderr
    assert ran.stdout.read(10)
    ran.stdout.close()
    said = ran.stderr.read().decode()
    ran.stderr.close()
    assert ran.wait() in (0, 10)
    assert said == ""
