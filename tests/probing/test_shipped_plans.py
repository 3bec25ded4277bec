"""Every shipped plan is run against every fake robot it is meant for, and executes reads only."""

import json
from pathlib import Path

import pytest

from sphero_probe.catalogue import ROBOTS
from sphero_probe.probing.plans.shipped import find_plan, plan_files
from sphero_probe.protocol.packets import Generation
from tests.support.cli import Cli

PLANS = [file.stem for file in plan_files()]


def test_the_promised_plans_are_there() -> None:
    assert PLANS == [
        "bolt_plus",
        "hello",
        "leds",
        "power",
        "self_description",
        "system_info",
        "v1_core",
        "v1_robot",
        "which_devices",
    ]


@pytest.mark.unmeasured
@pytest.mark.parametrize("name", PLANS)
def test_it_runs_and_executes_reads_only(cli: Cli, name: str, tmp_path: Path) -> None:
    second = tuple(key for key, robot in ROBOTS.items() if robot.generation is Generation.V2)
    for key in find_plan(name).robots or second:
        ledger = tmp_path / f"{key}.jsonl"
        ran = cli("sweep", "--plan", name, "--device", f"fake:{key}?ledger={ledger}", "--format", "jsonl")
        assert ran.code == 0, ran.err
        rows = [json.loads(line) for line in ran.out.splitlines()]
        summary = rows[-1]
        assert summary["type"] == "summary"
        assert summary["complete"] is True
        assert summary["counts"]["inconclusive"] == summary["counts"]["silent"] == 0
        executed = [json.loads(line) for line in ledger.read_text().splitlines()]
        assert {command["risk"] for command in executed} == {"read"}


def test_a_plan_for_other_robots_says_so(cli: Cli) -> None:
    ran = cli("sweep", "--plan", "v1_core", "--device", "fake:bolt", "--format", "plain")
    assert ran.code == 0
    assert "meant for sphero" in ran.err


@pytest.mark.parametrize(
    ("device", "matrix"),
    [("fake:bolt-plus", {"absent"}), ("fake:bolt-plus?matrix=1", {"exists"})],
    ids=["as described", "with BOLT's matrix"],
)
def test_bolt_plus_shows_bad_target_for_node_0x12(cli: Cli, device: str, matrix: set[str]) -> None:
    ran = cli("sweep", "--plan", "probe_plans/bolt_plus.py", "--device", device, "--format", "jsonl")
    findings = [json.loads(line) for line in ran.out.splitlines() if '"type": "finding"' in line]
    secondary = [finding for finding in findings if finding["target"] == 0x12]
    assert len(secondary) == 6
    assert {(finding["code"], finding["outcome"]) for finding in secondary} == {(9, "absent")}
    primary = [finding for finding in findings if finding["target"] == 0x11]
    of_matrix = {finding["cid"] for finding in secondary}
    on_matrix = [f for f in primary if f["did"] == 0x1A and f["cid"] in of_matrix]
    asked = [finding for finding in primary if finding["outcome"] != "skipped"]
    assert {finding["outcome"] for finding in asked if finding in on_matrix} == matrix
    assert {finding["outcome"] for finding in asked if finding not in on_matrix} == {"exists"}
    assert all("not sent" in finding["note"] for finding in primary if finding["outcome"] == "skipped")


def test_self_description_asks_about_what_the_robot_claims(cli: Cli, tmp_path: Path) -> None:
    truth = tmp_path / "truth.jsonl"
    ran = cli(
        "sweep", "--plan", "self_description", "--device", f"fake:rvr?truth={truth}", "--format", "jsonl"
    )
    findings = [json.loads(line) for line in ran.out.splitlines() if '"type": "finding"' in line]
    claimed = findings[0]["fields"]["dids"]
    facts = [json.loads(line) for line in truth.read_text().splitlines()]
    assert set(claimed) == {fact["did"] for fact in facts if fact["node"] == 1}
    assert [finding["cid"] for finding in findings[1:]] == [6] * len(claimed)


def test_a_plan_of_which_devices_tells_them_apart(cli: Cli, tmp_path: Path) -> None:
    truth = tmp_path / "truth.jsonl"
    ran = cli("sweep", "--plan", "which_devices", "--device", f"fake:bolt?truth={truth}", "--format", "jsonl")
    findings = [json.loads(line) for line in ran.out.splitlines() if '"type": "finding"' in line]
    there = {finding["did"] for finding in findings if finding["code"] == 2}
    not_there = {finding["did"] for finding in findings if finding["code"] == 1}
    facts = {json.loads(line)["did"] for line in truth.read_text().splitlines() if '"node":1' in line}
    withheld = {finding["did"] for finding in findings if finding["outcome"] == "skipped"}
    assert there == facts - withheld
    assert not_there.isdisjoint(facts)
    assert withheld == {0x1B, 0x1D, 0x1E, 0x1F, 0x20, 0xFE}
