"""``fleet`` on the built-in robots: each robot as with the single command, and one report for all."""

import csv
import io
from pathlib import Path
from typing import Any

import pytest

from tests.support.cli import Cli, Ran, objects

ONE, TWO, OTHER = "fake:bolt-plus?seed=1", "fake:bolt-plus?seed=2", "fake:rvr?seed=3"
GONE = "fake:bolt-plus?seed=4&disconnect_after=2"
SWEEP = ("--did", "0x13", "--cid", "0x00-0x2f")


def devices(*addresses: str) -> tuple[str, ...]:
    return tuple(word for address in addresses for word in ("--device", address))


def robots(ran: Ran) -> dict[str, dict[str, Any]]:
    """Device -> its row."""
    return {row["device"]: row for row in objects(ran.out) if row["type"] == "fleet_robot"}


def journal_of(row: dict[str, Any]) -> list[dict[str, Any]]:
    """The findings of a robot's journal by number, without times."""
    lines = objects(Path(row["journal"]).read_text(encoding="utf-8"))
    found = {line["number"]: line for line in lines if line["type"] == "finding"}
    return [_timeless(found[number]) for number in sorted(found)]


def _timeless(line: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in line.items() if key != "seconds"}


def test_a_sweep_keeps_for_each_robot_the_journal_of_a_single_run(cli: Cli, tmp_path: Path) -> None:
    ran = cli("fleet", "sweep", *SWEEP, *devices(ONE, OTHER), "--format", "jsonl")
    assert ran.code == 0, ran.err
    for number, (device, row) in enumerate(robots(ran).items()):
        alone = tmp_path / f"{number}.jsonl"
        assert cli("sweep", *SWEEP, "--device", device, "--journal", str(alone)).code == 0
        assert journal_of(row) == journal_of({"journal": alone})
        assert row["status"] == "done"
        assert sum(row["counts"].values()) == 0x30
        assert row["battery"]
        assert row["firmware"]


def test_a_robot_that_fails_is_told_and_resume_finishes_what_can_be_finished(cli: Cli) -> None:
    arguments = ("fleet", "sweep", *SWEEP, *devices(ONE, GONE), "--format", "jsonl")
    ran = cli(*arguments)
    assert ran.code == 5
    assert (robots(ran)[ONE]["status"], robots(ran)[GONE]["status"]) == ("done", "incomplete")
    assert "1 of 2 robots without a complete result" in ran.err
    assert "--resume" in ran.err
    before = robots(ran)[ONE]
    written = Path(before["journal"]).read_bytes()
    resumed = cli(*arguments, "--resume")
    assert resumed.code == 5
    assert robots(resumed)[ONE]["journal"] == before["journal"]
    assert robots(resumed)[ONE]["counts"] == before["counts"]
    assert Path(before["journal"]).read_bytes() == written, "a finished robot is asked nothing"
    assert robots(resumed)[GONE]["journal"] == robots(ran)[GONE]["journal"]


def test_the_matrix_leads_with_the_commands_in_which_robots_differ(cli: Cli) -> None:
    ran = cli("fleet", "sweep", *SWEEP, *devices(ONE, TWO, OTHER), "--format", "jsonl")
    rows = [row for row in objects(ran.out) if row["type"] == "matrix"]
    differs = [row["differs"] for row in rows]
    assert differs == sorted(differs, reverse=True)
    assert any(differs)
    assert not all(differs)
    assert len(rows) == 0x30
    (voltage,) = (row for row in rows if row["cid"] == 0x25)
    assert voltage["differs"]
    assert {title[:11]: state for title, state in voltage["states"].items()} == {
        "Sphero BOLT": "absent",
        "Sphero RVR ": "exists",
    }
    table = cli("fleet", "sweep", *SWEEP, *devices(ONE, OTHER), "--format", "table").out
    assert "The robots differ in" in table
    assert "0x13:0x25" in table
    assert "--detail lists them" in table
    page = cli("fleet", "sweep", *SWEEP, *devices(ONE, OTHER), "--format", "html").out
    assert all(said in page for said in ("BP-5912", "power.get_battery_voltage_in_volts", 'id="below"'))
    written = cli("fleet", "sweep", *SWEEP, *devices(ONE, OTHER), "--format", "csv", "--matrix").out
    assert next(csv.DictReader(io.StringIO(written)))["cid"] == "0x03"


def test_health_tells_of_each_robot_how_well_it_works(cli: Cli) -> None:
    ran = cli("fleet", "health", *devices(ONE, OTHER), "--format", "jsonl")
    assert ran.code == 0
    told = robots(ran)
    assert told[ONE]["awake"] is True
    assert told[ONE]["echoes"] == [10, 10]
    assert set(told[OTHER]["firmware"]) == {"primary", "secondary"}
    assert told[OTHER]["dead_nodes"] == []
    assert told[ONE]["journal"] is None


def test_led_lights_each_robot_in_another_colour_or_all_in_one(cli: Cli) -> None:
    ran = cli("fleet", "led", *devices(ONE, TWO, OTHER), "--format", "jsonl")
    assert ran.code == 0, ran.err
    colours = [tuple(set(row["leds"].values())) for row in robots(ran).values()]
    assert colours == [("red",), ("lime",), ("blue",)]
    ran = cli("fleet", "led", "--front", "00f", *devices(ONE, TWO), "--format", "jsonl")
    assert [row["leds"] for row in robots(ran).values()] == [{"front": "0000ff"}] * 2
    ran = cli("fleet", "led", "--led", "left_headlight=00f", *devices(ONE, OTHER), "--format", "jsonl")
    assert ran.code == 5
    assert {device: row["status"] for device, row in robots(ran).items()} == {ONE: "failed", OTHER: "done"}


def test_evidence_is_written_without_what_identifies_a_robot(cli: Cli, tmp_path: Path) -> None:
    ran = cli("fleet", "evidence", *devices(ONE), "--folder", str(tmp_path / "new"), "--format", "jsonl")
    assert ran.code == 0, ran.err
    (row,) = robots(ran).values()
    files = sorted((tmp_path / "new").iterdir())
    assert [file.name for file in files] == ["bolt-plus-1.json", "bolt-plus-1.md"]
    assert all(row["name"] not in file.read_text(encoding="utf-8") for file in files)
    assert cli("evidence", "check", str(files[0])).code == 0


@pytest.mark.parametrize("allowed", [(), ("--allow", "write"), ("--allow", "motion")])
def test_what_a_robot_executes_is_what_it_executes_alone(
    cli: Cli, tmp_path: Path, allowed: tuple[str, ...]
) -> None:
    def ledger(name: str) -> str:
        return f"{ONE}&ledger={tmp_path / name}"

    arguments = ("--did", "0x1a,0x16", "--cid", "0x00-0x10", *allowed)
    fleet = cli("fleet", "sweep", *arguments, *devices(ledger("fleet"), OTHER))
    cli("sweep", *arguments, "--device", ledger("alone"))
    assert fleet.code in (0, 5)
    executed = [_executed(tmp_path / name) for name in ("fleet", "alone")]
    battery = [pair for pair in executed[0] if pair[0] == 0x13]
    assert [pair for pair in executed[0] if pair not in battery] == [
        pair for pair in executed[1] if pair not in battery
    ]


def _executed(path: Path) -> list[tuple[int, int, str]]:
    return [(line["did"], line["cid"], line["risk"]) for line in objects(path.read_text(encoding="utf-8"))]


def test_brick_is_confirmed_by_the_name_of_each_robot(cli: Cli, tmp_path: Path) -> None:
    names = [
        row["name"]
        for row in robots(cli("fleet", "health", *devices(ONE, TWO), "--format", "jsonl")).values()
    ]
    ledger = tmp_path / "ledger"
    two = f"{TWO}&ledger={ledger}"
    arguments = (
        "fleet",
        "sweep",
        "--did",
        "0x13",
        "--cid",
        "0x02-0x04",
        *devices(ONE, two),
        "--format",
        "jsonl",
    )
    unnamed = cli(*arguments, "--allow", "brick")
    assert (unnamed.code, "--confirm" in unnamed.err) == (6, True)
    ran = cli(*arguments, "--allow", "brick", "--confirm", names[0])
    assert ran.code == 6
    told = robots(ran)
    assert told[ONE]["status"] == "done"
    assert (told[two]["status"], names[1] in told[two]["trouble"]) == ("refused", True)
    assert ledger.read_bytes() == b"", "nothing was sent"
    both = cli(*arguments, "--allow", "brick", "--confirm", names[0], "--confirm", names[1])
    assert both.code == 0


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("health",), 2, "no robot is named"),
        (("health", "--all", *devices(ONE)), 2, "exclude each other"),
        (("health", *devices(ONE, ONE)), 2, "named twice"),
        (("sweep", *devices(ONE)), 2, "nothing to sweep"),
        (("sweep", "--did", "0x13", "--resume", "--no-journal", *devices(ONE)), 2, "exclude each other"),
        (("health", "--robots", "no-such.toml"), 8, "no such file"),
        (("sweep", "--did", "0x13", *devices(ONE), "--capture", "x"), 2, "the frames of one robot"),
        (("discover", *devices(ONE), "--journal", "x"), 2, "keeps a journal of its own"),
        (("--device", ONE, "sweep", "--did", "0x13"), 2, "write --device after the subcommand"),
        (
            ("--matrix", "sweep", "--did", "0x13"),
            2,
            "after the subcommand: sphero-probe fleet sweep --matrix",
        ),
        (("--devices", ONE, "sweep"), 2, "No such option '--devices'"),
        (("sweep", "0x13", *devices(ONE)), 2, "write --did 0x13"),
        (("sweep", "--did", "0x13", ONE), 2, "unexpected extra argument"),
        (("health", *devices(" ")), 2, "a name is empty"),
        (("health", "--per-adapter", "0", *devices(ONE)), 2, "--per-adapter"),
        (("scan", "--save", "class.txt", "--timeout", "0.1"), 10, ".toml or .csv"),
    ],
)
def test_bad_input_gives_one_clear_line(cli: Cli, arguments: tuple[str, ...], code: int, said: str) -> None:
    ran = cli("fleet", *arguments)
    assert (ran.code, said in ran.err.splitlines()[0]) == (code, True), ran.err
    assert "Traceback" not in ran.err


def test_a_fleet_file_names_the_robots(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "class.csv"
    file.write_text(f"name,address,label\nblue one,{ONE},table 3\n,{OTHER},\n", encoding="utf-8")
    told = robots(cli("fleet", "health", "--robots", str(file), "--format", "jsonl"))
    assert told[ONE]["label"] == "table 3"
    assert set(told) == {ONE, OTHER}


def test_a_robot_that_restarts_tells_at_which_command(cli: Cli) -> None:
    restarting = "fake:bolt-plus?seed=9&reboot_on=0x13:0x20&interval=15ms"
    arguments = ("fleet", "sweep", *SWEEP, *devices(ONE, restarting))
    ran = cli(*arguments, "--format", "jsonl")
    assert ran.code == 0, ran.err
    row = robots(ran)[restarting]
    assert (row["status"], row["counts"]["inconclusive"]) == ("done", 1)
    assert row["trouble"] == "the link dropped twice while 0x13:0x20 was in flight"
    assert robots(ran)[ONE]["trouble"] is None
    assert "1 inconclusive; the link dropped twice while 0x13:0x20 was in flight" in ran.err
    assert "done: the link dropped" in " ".join(cli(*arguments, "--format", "table").out.split())
