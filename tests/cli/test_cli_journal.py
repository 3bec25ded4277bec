"""Journals from the command line: kept by every run, gone on with, shown again, listed."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from sphero_probe.cli.values import FORMATS
from sphero_probe.runs.journal import Journal
from sphero_probe.runs.store import runs_folder, slug
from tests.support.cli import Cli

PROBE = (sys.executable, "-m", "sphero_probe")
FAKE = ("--device", "fake:bolt-plus")
SLOW = ("--device", "fake:bolt-plus?latency=20ms")
SWEEP = ("sweep", "--did", "0x13", "--cid", "0-0x1f")
PLAN = """
from sphero_probe.probing.plan import Plan, Probe
from sphero_probe.protocol.packets import Command
PLAN = Plan("mine", "", [[Probe(Command(0x13, cid)) for cid in range(16)]])
"""


@pytest.fixture
def folder() -> Path:
    return runs_folder()


def kept(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.jsonl"))


def entries(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_bytes().splitlines()]


def cut(path: Path, findings: int) -> bytes:
    """Cut a journal off after so many findings, in the middle of a line."""
    lines = path.read_bytes().splitlines(keepends=True)
    places = [at for at, line in enumerate(lines) if b'"type":"finding"' in line]
    held = b"".join(lines[: places[findings - 1] + 1]) + b'{"type":"int'
    path.write_bytes(held)
    return held


def said(text: str) -> dict[int, tuple[object, ...]]:
    rows = [json.loads(line) for line in text.splitlines()]
    keys = ("target", "did", "cid", "name", "risk", "outcome", "confidence", "code", "note")
    return {row["number"]: tuple(row[key] for key in keys) for row in rows if row["type"] == "finding"}


def test_every_command_that_sends_keeps_one(cli: Cli, folder: Path) -> None:
    cli(*SWEEP, *FAKE)
    cli("send", "0x13", "0x10", *FAKE)
    cli("led", "--front", "f00", *FAKE)
    assert sorted(entries(path)[0]["command"] for path in kept(folder)) == ["led", "send", "sweep"]
    for path in kept(folder):
        types = [entry["type"] for entry in entries(path)]
        assert types[:2] == ["journal", "run"]
        assert {"intent", "finding", "summary"} <= set(types)
        assert path.stat().st_mode & 0o077 == 0
        assert path.name.startswith("20")
        assert "-bp-be56-" in path.name


def test_what_only_looks_keeps_none(cli: Cli, folder: Path) -> None:
    cli(*SWEEP, *FAKE, "--dry-run")
    cli("led", "--off", *FAKE, "--dry-run")
    cli("info", *FAKE)
    cli(*SWEEP, *FAKE, "--no-journal")
    cli("send", "0x13", "0x10", *FAKE, "--no-journal")
    assert kept(folder) == []


def test_runs_in_the_same_second_do_not_meet(cli: Cli, folder: Path) -> None:
    for _ in range(3):
        assert cli("send", "0x13", "0x10", *FAKE).code == 0
    assert len(kept(folder)) == 3


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("device", ["bolt-plus", "bolt?loss=0.02&seed=2", "ollie"])
@pytest.mark.parametrize("run", [SWEEP, ("send", "0x13", "0x10"), ("sweep", "--plan", "hello")], ids=" ".join)
def test_a_report_shows_what_the_run_showed(cli: Cli, form: str, device: str, run: tuple[str, ...]) -> None:
    live = cli(*run, "--device", f"fake:{device}", "--format", form)
    assert live.out
    again = cli("report", "last", "--format", form)
    assert (again.code, again.err) == (0, "")
    assert lines_of(again.out) == lines_of(live.out)


def lines_of(text: str) -> list[str]:
    """The lines in any order: a run shows findings as they come, a report by number."""
    return sorted(line.rstrip(",") for line in text.splitlines())


def test_a_run_is_named_by_path_name_or_last(cli: Cli, folder: Path, tmp_path: Path) -> None:
    cli(*SWEEP, *FAKE)
    (path,) = kept(folder)
    shown = cli("report", "last").out
    assert shown
    for name in (str(path), path.name, path.stem):
        assert cli("report", name).out == shown
    for name in ("no-such", "../runs/x", str(tmp_path / "x"), "nul\0"):
        ran = cli("report", name)
        assert ran.code == 8
        assert "no such run" in ran.err


def test_going_on_asks_only_what_is_missing(cli: Cli, folder: Path, tmp_path: Path) -> None:
    whole = cli(*SWEEP, *FAKE, "--format", "jsonl").out
    (path,) = kept(folder)
    cut(path, 10)
    ran = cli("sweep", "--resume", path.name, *FAKE, "--format", "jsonl")
    assert (ran.code, ran.err) == (0, "")
    assert said(ran.out) == said(whole)
    assert said(cli("report", "last", "--format", "jsonl").out) == said(whole)
    runs = [entry for entry in entries(path) if entry["type"] == "run"]
    assert [entry["resumed"] for entry in runs] == [False, True]
    answered = [entry["number"] for entry in entries(path) if entry["type"] == "finding"]
    assert len(answered) == len(set(answered)) == 32
    assert kept(folder) == [path]


@pytest.mark.parametrize("given", [(), ("--did", "power", "--cid", "0-31")], ids=["alone", "said-again"])
def test_the_ranges_are_known_from_the_journal(cli: Cli, tmp_path: Path, given: tuple[str, ...]) -> None:
    path = str(tmp_path / "run.jsonl")
    whole = cli(*SWEEP, *FAKE, "--payload", "00" * 11, "--journal", path, "--format", "jsonl").out
    cut(Path(path), 7)
    payload = ("--payload", "00" * 11) if given else ()
    ran = cli("sweep", "--resume", path, *given, *payload, *FAKE, "--format", "jsonl")
    assert ran.code == 0, ran.err
    assert said(ran.out) == said(whole)


def test_a_shipped_plan_goes_on_and_a_plan_of_ones_own_must_be_named(
    cli: Cli, folder: Path, tmp_path: Path
) -> None:
    assert cli("sweep", "--plan", "power", *FAKE).code == 0
    cut(kept(folder)[0], 2)
    assert cli("sweep", "--resume", "last", *FAKE).code == 0
    (tmp_path / "mine.py").write_text(PLAN)
    own = str(tmp_path / "mine.py")
    path = str(tmp_path / "run.jsonl")
    whole = cli("sweep", "--plan", own, *FAKE, "--journal", path, "--format", "jsonl").out
    cut(Path(path), 5)
    refused = cli("sweep", "--resume", path, *FAKE)
    assert refused.code == 2
    assert f"--plan {own}" in refused.err
    ran = cli("sweep", "--resume", path, "--plan", own, *FAKE, "--format", "jsonl")
    assert said(ran.out) == said(whole)
    cut(Path(path), 5)
    (tmp_path / "mine.py").write_text(PLAN + "\n# changed")
    changed = cli("sweep", "--resume", path, "--plan", own, *FAKE)
    assert changed.code == 8
    assert "another plan" in changed.err


@pytest.mark.parametrize(
    ("arguments", "code", "why"),
    [
        pytest.param(("--device", "fake:bolt"), 8, "another robot", id="model"),
        pytest.param(("--device", "fake:bolt-plus?seed=5"), 8, "another robot", id="name"),
        pytest.param((*FAKE, "--did", "0x14"), 8, "another plan", id="did"),
        pytest.param((*FAKE, "--plan", "hello"), 8, "another plan", id="plan"),
        pytest.param((*FAKE, "--target", "secondary"), 8, "another node", id="node"),
        pytest.param((*FAKE, "--allow", "write"), 6, "was allowed read, probe", id="consent"),
        pytest.param((*FAKE, "--journal", "x"), 2, "exclude each other", id="two-journals"),
        pytest.param((*FAKE, "--no-journal"), 2, "exclude each other", id="no-journal"),
        pytest.param((*FAKE, "--dry-run"), 2, "--dry-run", id="dry-run"),
    ],
)
def test_going_on_with_something_else_is_refused(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...], code: int, why: str
) -> None:
    path = tmp_path / "run.jsonl"
    cli(*SWEEP, *FAKE, "--journal", str(path))
    held = cut(path, 9)
    ran = cli("sweep", "--resume", str(path), *arguments)
    assert ran.code == code, ran.err
    assert why in ran.err
    assert len(ran.err.splitlines()) == 1 if code == 8 else 2
    assert ran.out == ""
    assert held.startswith(path.read_bytes())


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"", id="empty"),
        pytest.param(random.Random(1).randbytes(5000), id="random"),
        pytest.param(b"hello\nworld\n", id="text"),
        pytest.param(b'{"type":"run"}\n', id="no-opening"),
        pytest.param(b'{"type":"journal","schema_version":2}\n', id="version"),
        pytest.param(b'{"type":"jour', id="torn"),
    ],
)
def test_what_is_no_journal(cli: Cli, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(content)
    for arguments in (("sweep", "--resume", str(path), *FAKE), ("report", str(path))):
        ran = cli(*arguments)
        assert ran.code == 8
        assert len(ran.err.splitlines()) <= 2
        assert str(path) in ran.err
        assert ran.out == ""


def test_a_journal_says_nothing_that_is_run_opened_or_allowed(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'pwned')!r}, 'w')")
    cli(*SWEEP, *FAKE, "--journal", str(path))
    cut(path, 3)
    first, rest = path.read_bytes().split(b"\n", 1)
    for options in (
        {"plan_file": str(tmp_path / "evil.py")},
        {"plan": str(tmp_path / "evil")},
        {"plan": "../evil"},
    ):
        evil = json.loads(first) | {"options": options, "address": f"fake:bolt?ledger={tmp_path / 'pwned'}"}
        path.write_bytes(json.dumps(evil).encode() + b"\n" + rest)
        assert cli("sweep", "--resume", str(path), *FAKE).code in (2, 8)
    bold = json.loads(first) | {"consent": ["read", "probe", "write", "brick"]}
    path.write_bytes(json.dumps(bold).encode() + b"\n" + rest)
    assert cli("sweep", "--resume", str(path), *FAKE).code == 6
    for ranges in ({"did": "0x13x"}, {"cid": "1"}, {"did": "19", "cid": "9-1"}):
        path.write_bytes(json.dumps(json.loads(first) | {"options": ranges}).encode() + b"\n" + rest)
        assert cli("sweep", "--resume", str(path), *FAKE).code == 8
    assert not (tmp_path / "pwned").exists()


def test_a_journal_of_send_is_not_gone_on_with(cli: Cli) -> None:
    cli("send", "0x13", "0x10", *FAKE)
    ran = cli("sweep", "--resume", "last", *FAKE)
    assert ran.code == 8
    assert "the journal of send" in ran.err


def test_a_journal_in_use_is_refused(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    with Journal.create(path):
        for arguments in ((*SWEEP, "--journal", str(path)), ("sweep", "--resume", str(path))):
            ran = cli(*arguments, *FAKE)
            assert ran.code == 11
            said, hint = ran.err.splitlines()
            assert said.startswith(f"sphero-probe: {path}: in use by ")
            assert "another journal" in hint


@pytest.mark.parametrize("place", ["/no/such/folder/x", ".", "nul\0"])
def test_a_journal_that_cannot_be_written(cli: Cli, place: str) -> None:
    ran = cli(*SWEEP, *FAKE, "--journal", place)
    assert ran.code == 10
    assert "cannot write" in ran.err
    assert ran.out == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("run", [SWEEP, ("send", "0x13", "0x10")], ids=" ".join)
def test_a_full_disk(cli: Cli, run: tuple[str, ...], tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"
    ran = cli(*run, "--device", f"fake:bolt?ledger={ledger}", "--journal", "/dev/full")
    assert ran.code == 10
    assert "/dev/full: No space left on device" in ran.err
    assert ledger.read_text() == ""


def test_a_disk_that_fills_up_tells_how_to_go_on(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    real, left = os.write, [40]

    def write(descriptor: int, data: bytes) -> int:
        left[0] -= data.startswith(b'{"type"')
        if left[0] < 0:
            raise OSError(28, "No space left on device")
        return real(descriptor, data)

    monkeypatch.setattr("sphero_probe.runs.journal.os.write", write)
    ran = cli(*SWEEP, *FAKE)
    monkeypatch.setattr("sphero_probe.runs.journal.os.write", real)
    (path,) = kept(folder)
    assert ran.code == 10
    assert ran.err.splitlines()[1:] == [
        f"  resume: sphero-probe sweep --resume {path} --device fake:bolt-plus"
    ]
    assert cli("sweep", "--resume", str(path), *FAKE).code == 0


def test_without_a_place_the_run_goes_on_with_a_warning(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    ran = cli(*SWEEP, *FAKE)
    assert ran.code == 0
    assert ran.out
    assert ran.err.startswith("warning: no journal is kept: cannot write")
    assert len(ran.err.splitlines()) == 1
    assert cli("runs").code in (0, 8)


@pytest.mark.parametrize(
    ("text", "made"),
    [
        ("BP-1234", "bp-1234"),
        ("../../etc/passwd", "etc-passwd"),
        ("\x1b]0;x\x07", "0-x"),
        ("漢字", ""),
        ("a" * 300, "a" * 40),
        ("CON.", "con"),
    ],
)
def test_slugs(text: str, made: str) -> None:
    assert slug(text) == made


def test_runs_are_listed_the_last_first(cli: Cli, folder: Path) -> None:
    assert json.loads(cli("runs", "--json").out) == []
    assert "No runs" in cli("runs", "--format", "table").out
    cli(*SWEEP, *FAKE)
    cli("send", "0x13", "0x10", "--device", "fake:mini")
    cut(kept(folder)[0], 4)
    os.utime(kept(folder)[0], ns=(0, 0))
    (folder / "broken.jsonl").write_bytes(b"\x00\xff\n")
    (folder / "unread.jsonl").mkdir()
    ran = cli("runs", "--json")
    assert (ran.code, ran.err) == (0, "")
    broken, sent, swept = json.loads(ran.out)
    assert broken["problem"].endswith("broken.jsonl:1: not valid JSON")
    assert (sent["command"], sent["model"], sent["complete"]) == ("send", "Sphero Mini", True)
    assert (swept["robot"], swept["plan"], swept["complete"]) == ("BP-BE56", "sweep", False)
    assert sum(swept["counts"].values()) == 4
    assert swept["when"].endswith("Z")
    table = cli("runs", "--format", "table").out
    assert "incomplete" in table
    assert "broken" in table
    named = [line.split()[0] for line in table.splitlines()[2:] if not line.startswith(" ")]
    assert [cli("report", name).code for name in named] == [8, 0, 0]
    assert len(cli("runs", "--format", "plain").out.splitlines()) == 3


def test_hostile_text_in_a_journal_is_harmless(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    cli(*SWEEP, *FAKE, "--journal", str(path))
    text = "\x1b]0;x\x07\u202e\n\t=1+1"
    changed = []
    for entry in entries(path):
        for key in ("device", "model", "plan", "note", "text", "tool_version", "started"):
            if key in entry:
                entry[key] = text
        changed.append(json.dumps(entry))
    path.write_text("\n".join(changed) + "\n")
    for form in FORMATS:
        shown = cli("report", str(path), "--format", form).out
        assert shown
        assert not {"\x1b", "\x07", "\u202e"} & set(shown)


def await_size(path: Path, size: int, process: subprocess.Popen[str]) -> None:
    while process.poll() is None and (not path.exists() or path.stat().st_size < size):
        time.sleep(0.002)


def start(path: Path, *arguments: str, did: str = "0x13") -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [*PROBE, "sweep", "--did", did, "--cid", "0-0x1f", *SLOW, "--journal", str(path), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("size", [0, 1, 1500, 4000, 7000, 12000])
def test_kill_9_and_on(cli: Cli, tmp_path: Path, size: int) -> None:
    whole = cli(*SWEEP, *SLOW, "--format", "jsonl", "--no-journal").out
    path = tmp_path / "run.jsonl"
    process = start(path)
    await_size(path, size, process)
    process.kill()
    process.communicate()
    answered = {
        e["number"] for e in map(json.loads, path.read_bytes().split(b"\n")[:-1]) if e["type"] == "finding"
    }
    ran = cli("sweep", "--resume", str(path), "--did", "0x13", "--cid", "0-0x1f", *SLOW, "--format", "jsonl")
    assert ran.code == 0, ran.err
    assert said(ran.out) == said(whole)
    findings = [entry["number"] for entry in entries(path) if entry["type"] == "finding"]
    assert len(findings) == len(set(findings)) == 32
    at = [entry["type"] == "run" and entry["resumed"] for entry in entries(path)]
    since = entries(path)[at.index(True) :] if True in at else []
    assert not answered & {entry["number"] for entry in since if entry["type"] == "intent"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_a_signal_tells_how_to_go_on(cli: Cli, tmp_path: Path, number: signal.Signals) -> None:
    path = tmp_path / "run.jsonl"
    process = start(path, "--allow", "write", did="0x10-0x1a")
    await_size(path, 3000, process)
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 128 + number
    resume = err.splitlines()[-1]
    assert resume == (f"resume: sphero-probe sweep --resume {path} --device '{SLOW[1]}' --allow write")
    fast = ("--device", "fake:bolt-plus")
    ran = cli("sweep", "--resume", str(path), *fast, "--allow", "write", "--format", "jsonl")
    assert ran.code == 0, ran.err
    assert len(said(ran.out)) == 11 * 32


def test_a_closed_pipe_leaves_a_journal_that_goes_on(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    process = start(path, "--format", "jsonl", did="0x10-0x1a")
    assert process.stdout
    assert process.stderr
    process.stdout.read(10)
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    assert process.wait() in (0, 10)
    ran = cli("sweep", "--resume", str(path), *FAKE, "--format", "jsonl")
    assert ran.code == 0, ran.err
    assert len(said(ran.out)) == 11 * 32


def test_a_lost_link_tells_how_to_go_on(cli: Cli, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    from sphero_probe.transports.fake import FakeTransport

    real, left = FakeTransport.write, [60]

    async def write(transport: FakeTransport, data: bytes) -> None:
        left[0] -= 1
        if left[0] < 0:
            transport.close()
        await real(transport, data)

    monkeypatch.setattr(FakeTransport, "write", write)
    ran = cli("sweep", "--did", "0x13", *FAKE)
    assert ran.code == 4
    (path,) = kept(folder)
    assert ran.err.splitlines()[-1] == f"  resume: sphero-probe sweep --resume {path} --device fake:bolt-plus"
    left[0] = 10**6
    ran = cli("sweep", "--resume", "last", *FAKE, "--format", "jsonl")
    assert ran.code == 0
    assert len(said(ran.out)) == 256


def test_a_run_that_ends_early_by_itself_is_incomplete(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    from sphero_probe.probing.engine import Engine

    real = Engine.records

    async def records(run: Engine) -> Any:
        run.stop.set()
        async for record in real(run):
            yield record

    monkeypatch.setattr(Engine, "records", records)
    ran = cli(*SWEEP, *FAKE)
    assert ran.code == 5
    assert "the run is incomplete: it was stopped before everything was asked" in ran.err
    assert "  resume: sphero-probe sweep --resume" in ran.err


def test_an_incomplete_run_names_the_command_that_was_executed(cli: Cli, folder: Path) -> None:
    """One of the hidden commands of this robot does not check its length."""
    ran = cli("sweep", "--did", "0x02", "--device", "fake:ollie?hidden=8&seed=5", "--format", "table")
    assert ran.code == 5
    assert ran.out.startswith("Executed: 0x02:0x2e unknown command accepted")
    assert "but 1 command accepted a wrong length" in " ".join(ran.out.split())
    assert "\nIncomplete: a wrong length was executed" in ran.out
    assert "the run is incomplete: a wrong length was executed" in ran.err
    assert "  resume: sphero-probe sweep --resume" in ran.err
