"""Many runs from the command line: listed, filtered, tagged, pruned, exported, compared across robots."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from sphero_probe.probing.finding import Outcome
from sphero_probe.runs.journal import Journal
from sphero_probe.runs.store import runs_folder
from tests.support.cli import Cli, objects
from tests.support.journals import finding, keep


@pytest.fixture
def survey() -> None:
    """Five runs of three robots, the newest last."""
    keep(
        "a",
        robot="BP-1",
        started="2026-01-01T00:00:00Z",
        written=1_000_000,
        findings=[finding(1, 0x13, 0x10)],
    )
    keep(
        "b",
        robot="BP-1",
        firmware={"primary": "2.0"},
        complete=False,
        written=1_000_100,
        findings=[finding(1, 0x13, 0x10, Outcome.ABSENT), finding(2, 0x13, 0x0D)],
    )
    keep(
        "c",
        robot="SM-1",
        model="mini",
        started="2026-03-01T00:00:00Z",
        written=1_000_200,
        findings=[finding(1, 0x13, 0x0D, Outcome.SILENT)],
    )
    keep("d", robot="BP-1", started="2026-03-02T00:00:00Z", written=1_000_300)
    keep("e", robot="BP-2", firmware={}, started="odd", written=1_000_400)


def listed(out: str) -> str:
    return "".join(Path(row["file"]).stem for row in objects(out))


@pytest.mark.usefixtures("survey")
@pytest.mark.parametrize(
    ("options", "expected"),
    [
        pytest.param("", "edcba", id="all, newest first"),
        pytest.param("--robot bp-1", "dba", id="a robot"),
        pytest.param("--robot BP-*", "edba", id="robots"),
        pytest.param("--model mini", "c", id="a model by its key"),
        pytest.param("--firmware 2.*", "b", id="a firmware"),
        pytest.param("--outcome incomplete", "b", id="incomplete"),
        pytest.param("--outcome complete --robot BP-1", "da", id="complete"),
        pytest.param("--since 2026-03-01", "dc", id="since"),
        pytest.param("--until 2026-01-02", "a", id="until"),
        pytest.param("--since 2026-01-02T03:04Z --until 2026-03-01T00:00:01+00:00", "cb", id="between"),
        pytest.param("--since 1h", "", id="an age"),
        pytest.param("--tag seen", "", id="no such tag"),
    ],
)
def test_runs_are_filtered(cli: Cli, options: str, expected: str) -> None:
    ran = cli("runs", "--format", "jsonl", *options.split())
    assert (ran.code, listed(ran.out)) == (0, expected)


@pytest.mark.usefixtures("survey")
def test_tags_are_kept_beside_the_journal(cli: Cli) -> None:
    journal = runs_folder() / "c.jsonl"
    before = journal.read_bytes()
    assert cli("runs", "tag", "c", "seen", "v1.2").code == 0
    assert cli("runs", "tag", "e", "seen").code == 0
    (row,) = objects(cli("runs", "tag", "c", "seen", "--remove", "--format", "jsonl").out)
    assert row["tags"] == ["v1.2"]
    assert journal.read_bytes() == before
    assert listed(cli("runs", "--tag", "seen", "--format", "jsonl").out) == "e"
    assert "v1.2" in cli("runs", "--format", "table").out
    assert cli("runs", "tag", "c", "v1.2", "--remove").code == 0
    assert sorted(path.name for path in runs_folder().glob("*.tags")) == ["e.tags"]


@pytest.mark.parametrize("word", ["", "two words", "-x", "\x1b]0;x", "é", "a" * 41])
def test_odd_tags_are_refused(cli: Cli, word: str) -> None:
    path = keep("a")
    ran = cli("runs", "tag", "--", "a", word)
    assert ran.code == 2
    assert "\x1b" not in ran.err
    assert [one.name for one in path.parent.iterdir()] == ["a.jsonl"]


@pytest.mark.usefixtures("survey")
def test_a_strangers_tags_are_harmless(cli: Cli) -> None:
    (runs_folder() / "a.tags").write_bytes(b"fine\n\x1b]0;pwn\x07\n\xff\n" + b"x" * 10_000)
    rows = {Path(row["file"]).stem: row["tags"] for row in objects(cli("runs", "--format", "jsonl").out)}
    assert rows["a"] == ["fine"]


@pytest.mark.usefixtures("survey")
def test_pruning_keeps_what_may_be_needed(cli: Cli) -> None:
    cli("runs", "tag", "a", "keep-me")
    damaged = runs_folder() / "damaged.jsonl"
    damaged.write_text("no journal\n")
    before = sorted(runs_folder().iterdir())
    would = cli("runs", "prune", "--keep", "0", "--dry-run", "--format", "jsonl")
    assert (would.code, listed(would.out)) == (0, "b")
    assert "Would remove 1 of 6" in would.err
    assert sorted(runs_folder().iterdir()) == before
    assert listed(cli("runs", "prune", "--keep", "5", "--format", "jsonl").out) == ""
    assert listed(cli("runs", "prune", "--keep", "0", "--older-than", "4000w", "--format", "jsonl").out) == ""
    with Journal.reopen(runs_folder() / "b.jsonl"):
        assert listed(cli("runs", "prune", "--keep", "0", "--format", "jsonl").out) == ""
    removed = cli("runs", "prune", "--keep", "0", "--older-than", "30d", "--format", "jsonl")
    assert listed(removed.out) == "b"
    assert sorted(runs_folder().iterdir()) == [path for path in before if path.name != "b.jsonl"]


def test_the_last_written_runs_stay(cli: Cli) -> None:
    for number in range(6):
        keep(f"r{number}", robot=f"BP-{number % 2}", written=1_000_000 + number)
    (runs_folder() / "r0.tags").write_text("")  # the file of a run without tags
    removed = cli("runs", "prune", "--keep", "3", "--format", "jsonl")
    assert listed(removed.out) == "r2r1r0"
    assert not (runs_folder() / "r0.tags").exists()
    assert listed(cli("runs", "--format", "jsonl").out) == "r5r4r3"


@pytest.mark.usefixtures("survey")
def test_an_export_holds_what_the_reports_show(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "runs.db"
    file.write_text("an earlier file")
    (runs_folder() / "damaged.jsonl").write_text("no journal\n")
    ran = cli("runs", "export", "--format", "sqlite", str(file), "--robot", "BP-1")
    assert (ran.code, ran.out) == (0, "")
    with closing(sqlite3.connect(file)) as database:
        assert database.execute("PRAGMA user_version").fetchall() == [(1,)]
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert database.execute("PRAGMA foreign_key_check").fetchall() == []
        named = dict(database.execute("SELECT name, id FROM runs"))
        assert sorted(named) == ["a", "b", "d"]
        database.row_factory = sqlite3.Row
        found = list(
            database.execute("SELECT * FROM findings WHERE run_id = ? ORDER BY number", [named["b"]])
        )
    shown = [row for row in objects(cli("report", "b", "--format", "jsonl").out) if row["type"] == "finding"]
    assert len(found) == len(shown) == 2
    for held, row in zip(found, shown, strict=True):
        for key in set(held.keys()) - {"run_id"}:
            told = json.loads(held[key]) if key in ("fields", "units") and held[key] else held[key]
            assert told == row[key], key
    assert list(tmp_path.iterdir()) == [file]


def test_an_export_has_the_length_checks_of_all_nodes(cli: Cli, tmp_path: Path) -> None:
    cli("discover", "--did", "0x13", "--device", "fake:bolt", "--format", "jsonl")
    cli("runs", "export", str(tmp_path / "runs.db"))
    with closing(sqlite3.connect(tmp_path / "runs.db")) as database:
        nodes = database.execute("SELECT node, firmware IS NOT NULL, strictness FROM nodes ORDER BY node")
        assert nodes.fetchall() == [("primary", 1, "strict"), ("secondary", 1, "strict")]


@pytest.mark.usefixtures("survey")
def test_an_export_that_fails_leaves_nothing_behind(cli: Cli, tmp_path: Path) -> None:
    assert cli("runs", "export", str(tmp_path / "no" / "runs.db")).code == 10
    folder = tmp_path / "folder"
    folder.mkdir()
    assert cli("runs", "export", str(folder)).code == 10
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


@pytest.mark.usefixtures("survey")
def test_the_matrix_leads_with_what_differs(cli: Cli) -> None:
    keep(
        "f",
        robot="BP-3",
        findings=[finding(1, 0x13, 0x10, Outcome.SKIPPED), finding(2, 0x13, 0x05, Outcome.ABSENT)],
    )
    first, second, third = objects(cli("matrix", "power", "--format", "jsonl").out)
    bolt, updated, mini = "Sphero bolt-plus 1.0", "Sphero bolt-plus 2.0", "Sphero mini 1.0"
    assert (first["cid"], first["differs"]) == (0x10, True)
    assert first["states"] == {bolt: "exists", updated: "absent", mini: "not asked"}
    assert (second["cid"], second["states"][bolt]) == (0x05, "absent")
    assert third["states"] == {bolt: "not asked", updated: "exists", mini: "silent"}
    table = cli("matrix", "power", "--format", "table")
    assert "+ exists" in table.out
    assert "- absent" in table.out
    assert "~ silent" in table.out
    assert "0x13:0x05" not in table.out
    assert "Not shown: 1 commands" in table.err
    (wake,) = objects(cli("matrix", "power.wake", "--model", "mini", "--format", "jsonl").out)
    assert wake["states"] == {mini: "silent"}
    assert cli("matrix", "0x13:0x0d", "--format", "plain").out.split("\t")[2] == "power.wake"


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        pytest.param(("matrix", "cooking"), "no device named 'cooking'", id="no device"),
        pytest.param(("matrix", "power.wak"), "power.wake", id="nearly a command"),
        pytest.param(("runs", "--since", "soon"), "'soon' is not a date", id="no date"),
        pytest.param(("runs", "prune", "--keep", "1", "--older-than", "30"), "is not an age", id="no age"),
        pytest.param(("runs", "prune"), "--keep", id="prune needs a number"),
        pytest.param(("runs", "--json", "prune", "--keep", "1"), "write --format after prune", id="order"),
        pytest.param(("runs", "prun"), "prun", id="no subcommand"),
    ],
)
def test_bad_input_is_refused(cli: Cli, arguments: tuple[str, ...], problem: str) -> None:
    ran = cli(*arguments)
    assert ran.code == 2
    assert problem in ran.err
