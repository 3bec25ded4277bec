"""``catalog --compare`` and the plan of a library's claims, from the command line."""

import json
from pathlib import Path

import pytest

from tests.support.cli import Cli, objects

CLAIMS = ("sweep", "--plan", "spherov2-claims")


def test_what_only_one_side_knows_is_listed(cli: Cli) -> None:
    ran = cli("catalog", "--compare", "spherov2", "--robot", "mini", "--json")
    rows = json.loads(ran.out)
    assert {row["known_by"] for row in rows} == {"sphero-probe"}
    assert all("mini" in row["robots"] for row in rows)
    assert f"only there: 0, only in the catalogue: {len(rows)}" in ran.err
    plain = cli("catalog", "--compare", "spherov2", "--robot", "mini").out.splitlines()
    assert [line.split("\t")[0] for line in plain] == ["sphero-probe"] * len(rows)
    table = cli("catalog", "--compare", "spherov2", "0x18", "--v2", "--format", "table").out
    assert "Known by" in table
    assert "0x18:" in table
    assert "0x13:" not in table


def test_a_checked_out_tree_is_compared(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "mini.py").write_text(
        "class Power:\n    _did = 19\n    def fly(toy): toy._execute(Power._encode(toy, 0xee, None))\n"
        "class Mini(ToyV2):\n    toy_type = T('Mini', 'SM-')\n    fly = Power.fly\n"
    )
    rows = objects(cli("catalog", "--compare", str(tmp_path), "--format", "jsonl").out)
    assert rows[0] == {
        "type": "library",
        "schema_version": rows[0]["schema_version"],
        "known_by": tmp_path.name,
        "generation": "v2",
        "did": 0x13,
        "cid": 0xEE,
        "kind": "command",
        "name": None,
        "their_name": "fly",
        "robots": ["mini"],
    }
    assert {row["known_by"] for row in rows[1:]} == {"sphero-probe"}


@pytest.mark.parametrize("place", ["nowhere", "sphero_sdk"])
def test_a_library_that_is_not_there_is_told(cli: Cli, place: str) -> None:
    ran = cli("catalog", "--compare", place)
    assert ran.code == 8
    assert len(ran.err.splitlines()) == 2


@pytest.mark.parametrize("robot", ["mini", "rvr", "bb8"])
def test_a_plan_asks_what_the_library_claims(cli: Cli, robot: str) -> None:
    planned = json.loads(cli(*CLAIMS, "--device", f"fake:{robot}", "--dry-run", "--json").out)
    ran = json.loads(cli(*CLAIMS, "--device", f"fake:{robot}", "--json", "--no-journal").out)
    findings = {(one["target"], one["did"], one["cid"]): one for one in ran if one["type"] == "finding"}
    assert findings.keys() == {(one["target"], one["did"], one["cid"]) for one in planned}
    assert len(findings) > 30
    assert {one["risk"] for one in findings.values() if one["sent"]} <= {"read", "probe"}
    assert "exists" in {one["outcome"] for one in findings.values()}
    assert not [one for one in ran if one["type"] == "note" and one["kind"] == "comparison"]


def test_what_is_claimed_and_absent_is_reported(cli: Cli, tmp_path: Path) -> None:
    """A recorded robot that says of all else that it has no such command."""
    journal = tmp_path / "run.jsonl"
    cli("sweep", "--did", "0x13", "--device", "fake:mini", "--journal", str(journal))
    device = f"replay:{journal}?unknown=0x02&speed=0"
    ran = json.loads(cli(*CLAIMS, "--device", device, "--json", "--no-journal").out)
    (note,) = [one for one in ran if one["type"] == "note" and one["kind"] == "comparison"]
    absent = {
        (one["did"], one["cid"]) for one in ran if one["type"] == "finding" and one["outcome"] == "absent"
    }
    assert {(one["did"], one["cid"]) for one in note["claimed_absent"]} == absent
    assert note["claimed_by"] == "spherov2 0.12.1"
    assert absent
    assert 0x13 not in {did for did, _ in absent}
    table = cli(*CLAIMS, "--device", device, "--format", "table", "--no-journal").out
    assert "Differences from spherov2 0.12.1" in table
    assert f"{len(absent)} claimed by spherov2 0.12.1, absent on this firmware" in table


def test_it_is_resumed_by_its_name(cli: Cli, tmp_path: Path) -> None:
    journal = tmp_path / "run.jsonl"
    whole = cli(*CLAIMS, "--device", "fake:mini", "--journal", str(journal), "--json")
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[: len(lines) * 2 // 3]))
    again = cli("sweep", "--resume", str(journal), "--device", "fake:mini", "--json")
    assert again.code == 0

    def found(text: str) -> list[tuple[int, int, str]]:
        return sorted(
            (one["did"], one["cid"], one["outcome"]) for one in json.loads(text) if one["type"] == "finding"
        )

    assert found(again.out) == found(whole.out)


@pytest.mark.parametrize(
    ("device", "words"),
    [("fake:lmq", "has no lmq"), ("AA:BB:CC:DD:EE:FF", "depends on the model")],
)
def test_a_robot_without_claims_is_a_usage_error(cli: Cli, device: str, words: str) -> None:
    ran = cli(*CLAIMS, "--device", device)
    assert ran.code == 2
    assert words in ran.err
