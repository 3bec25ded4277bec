"""A recorded run, replayed, gives the findings of the run; so does its capture, as far as it goes."""

import json
from pathlib import Path
from typing import Any, Final

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.runs.store import journal_files
from sphero_probe.simulator.response_style import RESPONSE_STYLES
from tests.support import capture_writers as writers
from tests.support.capture_conversation import found_v2, woven
from tests.support.cli import Cli, objects

DIFFERING: Final = frozenset({"sent", "received", "rtt_ms", "attempts"})
"""Keys of a finding that hold sequence numbers, times and repetitions."""
MODELS: Final = [key for key, robot in ROBOTS.items() if robot.generation in RESPONSE_STYLES]
TROUBLE: Final = [
    "bolt-plus?hidden=20&seed=3",
    "rvr?mask=1",
    "bolt?strict=none",
    "mini?strict=minimum&claims=lying",
    "bb8?mask=0x00&hidden=9",
    "sprk-plus?strict=none",
]


def run_of(text: str) -> tuple[dict[int, dict[str, Any]], dict[str, Any]]:
    """The findings by number and the heading of a JSON report, without what differs from run to run."""
    entries = json.loads(text)
    findings = [entry for entry in entries if entry["type"] == "finding"]
    (heading,) = [entry for entry in entries if entry["type"] == "run"]
    return (
        {one["number"]: {key: one[key] for key in one if key not in DIFFERING} for one in findings},
        {key: heading[key] for key in heading if key != "started"},
    )


def recorded(cli: Cli, journal: Path, device: str, *what: str) -> str:
    return cli(*what, "--device", f"fake:{device}", "--json", "--journal", str(journal)).out


def replayed(cli: Cli, device: str, *what: str) -> str:
    return cli(*what, "--device", f"replay:{device}", "--json", "--no-journal").out


def compare(cli: Cli, tmp_path: Path, device: str, *what: str) -> None:
    journal = tmp_path / "run.jsonl"
    before = recorded(cli, journal, device, *what)
    after = replayed(cli, f"{journal}?speed=0", *what)
    assert run_of(after) == run_of(before)
    assert len(run_of(before)[0]) > 20


@pytest.mark.parametrize("device", [*MODELS, *TROUBLE])
def test_a_replayed_sweep_gives_the_findings_of_the_run(cli: Cli, tmp_path: Path, device: str) -> None:
    did = "0x13" if ROBOTS[device.partition("?")[0]].generation == "v2" else "0x00,0x02"
    compare(cli, tmp_path, device, "sweep", "--did", did, "--cid", "0x00-0x24,0xfd")


@pytest.mark.slow
@pytest.mark.parametrize("device", ["bolt?hidden=5", "bolt-plus?claims=partial", "bb8", "mini?mask=1"])
def test_a_replayed_discovery_gives_the_findings_of_the_run(cli: Cli, tmp_path: Path, device: str) -> None:
    compare(cli, tmp_path, device, "discover")


def test_a_capture_of_a_run_replays_it(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "run.pcapng"
    what = ("sweep", "--did", "0x13", "--cid", "0x00-0x30")
    ran = cli(*what, "--device", "fake:bolt", "--json", "--no-journal", "--capture", str(file))
    again = replayed(cli, f"{file}?robot=bolt&speed=0", *what)
    assert run_of(again)[0] == run_of(ran.out)[0]


def test_a_foreign_capture_answers_what_it_holds_and_nothing_else(cli: Cli, tmp_path: Path) -> None:
    """What it holds is what ``capture show`` prints."""
    capture = tmp_path / "app.btsnoop"
    capture.write_bytes(writers.btsnoop(writers.hci(woven(found_v2()))))
    shown = objects(cli("capture", "show", str(capture), "--format", "jsonl").out)
    device = ("--json", "--no-journal", "--device", f"replay:{capture}?speed=0")
    answers = {(one["did"], one["cid"]): one for one in shown if one.get("kind") == "response"}
    assert len(answers) == 4
    for asked in shown:
        if asked.get("kind") != "command":
            continue
        words = [f"0x{asked[key]:02x}" for key in ("did", "cid")]
        words += [asked["payload"]] if asked.get("payload") else []
        target = f"0x{asked['target']:02x}"
        allowed = ("--allow", "write", "--allow", "motion", "--allow", "persist")
        (finding,) = json.loads(cli("send", *words, "--target", target, *allowed, *device).out)
        if finding["outcome"] == "skipped":
            assert finding["risk"] == "brick"
            continue
        answer = answers.pop((asked["did"], asked["cid"]))
        assert (finding["code"], finding["payload"]) == (answer["code"], answer.get("payload", ""))
    assert len(answers) <= 1
    (unknown,) = json.loads(cli("send", "0x13", "0x04", *device).out)
    assert (unknown["outcome"], unknown["note"]) == ("inconclusive", "not recorded")


@pytest.mark.parametrize("suffix", ["json", "jsonl"])
def test_a_report_replays_its_run(cli: Cli, tmp_path: Path, suffix: str) -> None:
    report = tmp_path / f"run.{suffix}"
    what = ("sweep", "--did", "0x13", "--cid", "0x00-0x30")
    cli(*what, "--device", "fake:bolt-plus?mask=0x13", "--no-journal", "-o", str(report))
    ran = json.dumps(objects(report.read_text())) if suffix == "jsonl" else report.read_text()
    assert run_of(replayed(cli, f"{report}?speed=0", *what)) == run_of(ran)


def test_findings_alone_answer_and_claim_no_absence(cli: Cli, tmp_path: Path) -> None:
    report = tmp_path / "run.jsonl"
    cli(
        "sweep",
        "--did",
        "0x13",
        "--cid",
        "0x00-0x30",
        "--device",
        "fake:bolt-plus",
        "--no-journal",
        "-o",
        str(report),
    )
    lines = [one for one in objects(report.read_text()) if one["type"] != "note"]
    report.write_text("".join(f"{json.dumps(one)}\n" for one in lines))
    told = {(one["did"], one["cid"]): one["outcome"] for one in lines if one["type"] == "finding"}
    after, _ = run_of(replayed(cli, f"{report}?speed=0", "sweep", "--did", "0x13,0x18", "--cid", "0x00-0x30"))
    for finding in after.values():
        earlier = told.get((finding["did"], finding["cid"]), "inconclusive")
        assert finding["outcome"] in {earlier, "skipped", "inconclusive"}
    exist = [one["name"] for one in after.values() if one["outcome"] == "exists"]
    assert "power.get_battery_percentage" in exist


@pytest.mark.parametrize(
    ("query", "code", "words"),
    [
        ("", 7, "the recording has no answer to this command"),
        ("?unknown=0x02", 7, "the robot answered 0x02 bad command id"),
        ("?unknown=silent", 7, "no answer to 0x13:0x17"),
        ("?unknown=error", 8, "0x13:0x17 to node 1 was never recorded"),
        ("?unknwn=error", 2, "did you mean unknown?"),
        ("x", 8, "cannot read"),
    ],
)
def test_what_was_never_recorded_is_told(cli: Cli, tmp_path: Path, query: str, code: int, words: str) -> None:
    journal = tmp_path / "run.jsonl"
    recorded(cli, journal, "bolt", "sweep", "--did", "0x13", "--cid", "0x10")
    device = f"replay:{journal}{query}"
    ran = cli("send", "0x13", "0x17", "--timeout", "50ms", "--no-journal", "--device", device)
    assert ran.code == code
    assert words in ran.err


def test_info_shows_what_was_recorded_only(cli: Cli, tmp_path: Path) -> None:
    journal = tmp_path / "run.jsonl"
    recorded(cli, journal, "bolt-plus", "sweep", "--did", "0x13", "--cid", "0x10")
    lines = dict(
        line.split("\t")[:2] for line in cli("info", "--device", f"replay:{journal}").out.splitlines()
    )
    assert lines["model"] == "Sphero BOLT+"
    assert lines["battery_percentage"].isdecimal()
    assert "mac_address" not in lines


@pytest.mark.parametrize("by", ["last", "stem", "name"])
def test_a_recorded_run_is_found_by_its_name(cli: Cli, by: str) -> None:
    cli("sweep", "--did", "0x13", "--cid", "0x10", "--device", "fake:bolt-plus")
    (path,) = journal_files()
    word = {"last": "last", "stem": path.stem, "name": path.name}[by]
    (finding,) = json.loads(
        cli("send", "0x13", "0x10", "--json", "--no-journal", "--device", f"replay:{word}?speed=0").out
    )
    assert finding["outcome"] == "exists"


def test_a_node_that_was_never_asked_does_not_answer(cli: Cli, tmp_path: Path) -> None:
    journal = tmp_path / "run.jsonl"
    recorded(cli, journal, "bolt", "sweep", "--did", "0x13", "--cid", "0x10,0x11")
    nodes = json.loads(cli("nodes", "--json", "--device", f"replay:{journal}").out)
    states = {one["address"]: one["state"] for one in nodes if one["type"] == "node"}
    assert states[0x11] == "answers"
    assert states[0x12] == "silent"


def test_a_dry_run_knows_the_recorded_robot(cli: Cli, tmp_path: Path) -> None:
    journal = tmp_path / "run.jsonl"
    recorded(cli, journal, "bb8", "sweep", "--did", "0x00", "--cid", "0x01,0x02")
    ran = cli("sweep", "--did", "core", "--cid", "1", "--dry-run", "--json", "--device", f"replay:{journal}")
    (planned,) = json.loads(ran.out)
    assert planned["name"] == "core.ping"
    assert planned["sent"].startswith("ff")
