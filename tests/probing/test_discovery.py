"""Discovery on fake robots: complete, compared with what the robot claims, and harmless."""

import json
from pathlib import Path
from typing import Any

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.probing.plans.discovery import LENGTHS, discovery
from sphero_probe.protocol.packets import Generation
from tests.support.cli import Cli, objects


def discover(cli: Any, device: str, *options: str) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the rows of a discovery, and the last finding of each number."""
    ran = cli("discover", "--device", device, "--format", "jsonl", *options)
    rows = objects(ran.out)
    executed = any(row.get("kind") == "executed" for row in rows)
    assert ran.code == (5 if executed else 0), ran.err
    assert rows[-1]["complete"] is not executed
    findings = {row["number"]: row for row in rows if row["type"] == "finding"}
    return rows, list(findings.values())


@pytest.mark.parametrize(
    "model",
    [pytest.param(model, marks=[] if model in ("bolt", "bb8") else [pytest.mark.slow]) for model in ROBOTS],
)
def test_all_that_exists_is_found_or_blocked_with_a_reason(cli: Cli, tmp_path: Path, model: str) -> None:
    truth, ledger = tmp_path / "truth", tmp_path / "ledger"
    low, high = (0x00, 0x02) if ROBOTS[model].generation is Generation.V1 else (0x10, 0x13)
    device = f"fake:{model}?hidden=8&seed=5&truth={truth}&ledger={ledger}"
    rows, findings = discover(cli, device, "--did", f"{low}-{high}")
    robot = ROBOTS[model]
    usual = {(fact["node"], fact["did"], fact["cid"]) for fact in objects(truth.read_text())}
    found: dict[bool, set[tuple[int, int, int]]] = {True: set(), False: set()}
    for finding in findings:
        node = 1 if finding["target"] is None else finding["target"] & 0x0F
        triple = node, finding["did"], finding["cid"]
        assert finding["outcome"] in ("exists", "absent", "skipped"), finding
        if finding["outcome"] == "skipped":
            assert "--allow" in finding["note"]
            found[False].add(triple)
        elif finding["outcome"] == "exists":
            assert triple in usual
            found[True].add(triple)
        elif finding["code_name"] != "bad target id":
            assert triple not in usual
    asked_nodes = {triple[0] for triple in found[True]}
    assert asked_nodes == (set(robot.nodes) if robot.addressed else {1})
    within = {triple for triple in usual if triple[0] in asked_nodes and low <= triple[1] <= high}
    assert within <= found[True] | found[False]
    risks = {row["risk"] for row in objects(ledger.read_text())}
    executed = any(row.get("kind") == "executed" for row in rows)
    assert risks <= ({"read", "motion"} if executed else {"read"})  # after a surprise the motors are stopped


def test_what_the_robot_claims_is_compared(cli: Cli, tmp_path: Path) -> None:
    truth = tmp_path / "truth"
    rows, findings = discover(
        cli, f"fake:bolt?claims=lying&hidden=6&seed=2&truth={truth}", "--did", "0x10-0x13"
    )
    (note,) = [row for row in rows if row["type"] == "note" and row["kind"] == "comparison"]
    facts = objects(truth.read_text())
    hidden_truth = {(fact["did"], fact["cid"]) for fact in facts if fact["hidden"]}
    unknown = {(pair["did"], pair["cid"]) for pair in note["unknown"]}
    assert unknown
    assert unknown <= hidden_truth
    exists = {(row["did"], row["cid"]) for row in findings if row["outcome"] == "exists"}
    absent = {(row["did"], row["cid"]) for row in findings if row["outcome"] == "absent"}
    assert {(pair["did"], pair["cid"]) for pair in note["hidden"]} <= exists
    assert {(pair["did"], pair["cid"]) for pair in note["ghost"]} <= absent
    assert note["ghost"]


def test_the_differences_lead_the_table(cli: Cli) -> None:
    ran = cli(
        *("discover", "--did", "0x10-0x13", "--device", "fake:bolt?claims=lying&hidden=6&seed=2"),
        *("--format", "table"),
    )
    assert "ghost (in the robot's list, but absent):" in ran.out
    assert ran.out.index("ghost (in the") < ran.out.index("get_battery_voltage")


def test_lengths_are_tried_if_consent_covers_them(cli: Cli, tmp_path: Path) -> None:
    ledger = tmp_path / "ledger"
    device = f"fake:bolt?hidden=12&seed=7&ledger={ledger}"
    _, withheld = discover(cli, device, "--did", "0x18", "--lengths")
    tried = [row for row in withheld if row["name"] is None and row["number"] > 512]
    assert {row["outcome"] for row in tried if row["risk"] != "probe"} <= {"skipped"}
    assert {row["risk"] for row in objects(ledger.read_text())} == {"read"}


def test_values_and_lengths_make_stages() -> None:
    plain = discovery(Generation.V2, 0x11)
    full = discovery(Generation.V2, 0x11, lengths=True, values=True)
    assert len(full.stages) > len(plain.stages) + len(LENGTHS)
    assert LENGTHS[-1] == 0
    assert plain.verify


def test_dry_run_and_resume_exclude_each_other(cli: Cli) -> None:
    ran = cli("discover", "--dry-run", "--resume", "last", "--device", "fake:bolt")
    assert ran.code == 2
    shown = cli("discover", "--dry-run", "--did", "0x13", "--device", "fake:bolt", "--json")
    assert shown.code == 0
    assert json.loads(shown.out)


def test_a_robot_in_trouble_is_mapped_all_the_same(cli: Cli) -> None:
    device = "fake:bolt?seed=3&hidden=4&sleep_after=1s&disconnect_after=300&loss=0.01"
    rows, findings = discover(cli, device, "--did", "0x13", "--timeout", "0.05")
    assert rows[-1]["complete"] is True
    assert {row["outcome"] for row in findings} <= {"exists", "absent", "skipped", "inconclusive"}
